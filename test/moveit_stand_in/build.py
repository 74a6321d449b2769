"""Generates and compiles a stand-in for moveit_msgs, which has no wheels, from the field lists in interfaces.py.

rosidl's own generators write the code, so the messages pass through the middleware as those of the real package do.
Needed are the wheels of ROS, a C++ compiler and the headers of Python. `python build.py FOLDER` makes it in half a
minute, and FOLDER belongs on PYTHONPATH then.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

PREFIX = Path(sys.prefix)  # of the wheels
INCLUDES = PREFIX / 'include'
USED = ('std_msgs', 'geometry_msgs', 'sensor_msgs', 'shape_msgs', 'trajectory_msgs', 'builtin_interfaces',
        'service_msgs')  # fmt: skip
ENCODINGS = ('rosidl_typesupport_fastrtps_c', 'rosidl_typesupport_introspection_c')  # a subscription needs both
PARTS = ('rosidl_generator_c', 'rosidl_typesupport_c', *ENCODINGS, 'rosidl_generator_py')
RUNTIME = ('rosidl_runtime_c', 'rosidl_typesupport_c', *ENCODINGS, 'rosidl_typesupport_fastrtps_cpp', 'rmw', 'rcutils',
           'fastcdr')  # fmt: skip
INTROSPECTION = 'introspection'  # a folder
COMPLETE = 'complete'  # a file, written last
TYPESUPPORT = 'rosidl_typesupport_c'  # the one that rclpy asks for
LOADER = '''"""Loads the libraries that the middleware asks for by name."""
import ctypes
from pathlib import Path

for library in Path(__file__).parent.glob('lib*.so'):
    ctypes.CDLL(str(library))
'''


def generate(folder: Path, package: str, interfaces: Mapping[str, str]) -> None:
    """Write the interface files of a package, and the code that rosidl makes of them, to folder/package."""
    from rosidl_adapter.cli import TranslateMsgToIDL, TranslateSrvToIDL
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    share = folder / 'share' / package
    idl: list[str] = []
    for kind, translator in (('msg', TranslateMsgToIDL('msg2idl')), ('srv', TranslateSrvToIDL('srv2idl'))):
        (share / kind).mkdir(parents=True, exist_ok=True)
        files = [f'{name}.{kind}' for name in interfaces if name.startswith(f'{kind}/')]
        for file in files:
            (share / file).write_text(interfaces[file.removesuffix(f'.{kind}')].replace('; ', '\n') + '\n')
        idl += translator.translate(package, [f'{share}:{file}' for file in files], [], share)
    includes = [str(PREFIX / 'share'), str(folder / 'share')]
    inside = folder / INTROSPECTION / package  # its files have names that others have too
    GenerateIntrospectionCTypesupport('introspection_c').generate(package, idl, includes, inside)
    for generator in (
        GenerateC('c'),
        GenerateFastRTPSCTypesupport('fastrtps_c'),
        GenerateCTypesupport('c', typesupport_implementations=list(ENCODINGS)),
        GeneratePython('py', typesupport_implementations=[TYPESUPPORT]),
    ):
        generator.generate(package, idl, includes, folder / package)
    for description in (folder / package).glob('*/*.json'):  # the next package looks for them there
        shutil.copy(description, share / description.parent.name)
    (folder / package / '__init__.py').write_text(LOADER)


def compile_package(folder: Path, package: str, others: list[str]) -> None:
    """Compile the code of a package to the one module that rclpy loads; others: packages compiled before."""
    code = [path for place in (folder, folder / INTROSPECTION) for path in (place / package).rglob('*')]
    headers = [folder, folder / INTROSPECTION, INCLUDES, *(path for path in INCLUDES.iterdir() if path.is_dir()),
               sysconfig.get_path('include'), np.get_include()]  # fmt: skip
    flags = ['-O2', '-fPIC', '-w', *(f'-I{path}' for path in headers), f'-DROSIDL_GENERATOR_C_BUILDING_DLL_{package}']

    def compile_one(source: Path) -> str:
        target = source.with_suffix('.o')
        subprocess.run(['g++' if source.suffix == '.cpp' else 'gcc', *flags, '-c', source, '-o', target], check=True)
        return str(target)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        objects = list(pool.map(compile_one, sorted(path for path in code if path.suffix in ('.c', '.cpp'))))
    libraries = [*(f'{name}__{part}' for name in USED for part in PARTS), *RUNTIME]
    built = [str(_module(folder, other)) for other in others]
    subprocess.run(
        ['g++', '-shared', '-o', _module(folder, package), *objects, *built, f'-L{PREFIX / "lib"}',
         f'-Wl,-rpath,{PREFIX / "lib"}:{folder}', *(f'-l{name}' for name in libraries)], check=True,
    )  # fmt: skip
    for encoding in ENCODINGS:  # the middleware asks for libraries of these names, which the package loads by its path
        library = f'lib{package}__{encoding}.so'
        subprocess.run(['gcc', '-shared', '-Wl,--no-as-needed', f'-Wl,-soname,{library}', '-o',
                        folder / package / library, _module(folder, package)], check=True)  # fmt: skip


def _module(folder: Path, package: str) -> Path:
    return folder / package / f'{package}_s__{TYPESUPPORT}.so'


def main() -> None:
    """Make the packages in the folder of the command line, unless they are there; one process at a time."""
    from interfaces import PACKAGES

    os.environ['AMENT_PREFIX_PATH'] = str(PREFIX)
    folder, done = Path(sys.argv[1]).resolve(), []
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / 'lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / COMPLETE).exists():
            for package, interfaces in PACKAGES.items():
                generate(folder, package, interfaces)
                compile_package(folder, package, done)
                done.append(package)
            (folder / COMPLETE).touch()


if __name__ == '__main__':
    main()
