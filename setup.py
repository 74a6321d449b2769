"""Package description for ament_python and pip: identity from package.xml, requirements from setup.cfg."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'ros_ik_pkg'
MANIFEST = ElementTree.parse(Path(__file__).with_name('package.xml')).getroot()


def share_files():
    """Return (folder, files) for what is installed beside the code, with its subfolders."""
    folders = {Path('.'): [Path('package.xml')]}
    for top in ('config', 'launch'):
        for path in sorted(Path(top).rglob('*')):
            if path.is_file() and '__pycache__' not in path.parts:
                folders.setdefault(path.parent, []).append(path)
    return [(str(Path('share', NAME) / folder), list(map(str, files))) for folder, files in folders.items()]


setup(
    name=NAME,
    version=MANIFEST.findtext('version'),
    description=MANIFEST.findtext('description'),
    long_description=Path(__file__).with_name('README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    maintainer=MANIFEST.findtext('maintainer'),
    license=MANIFEST.findtext('license'),
    keywords=['inverse kinematics', 'robotics', 'ROS 2', 'Jacobian', 'damped least squares', 'manipulator'],
    classifiers=[
        'Development Status :: 4 - Beta',
        'Environment :: Console',
        'Intended Audience :: Developers',
        'Intended Audience :: Education',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        *(f'Programming Language :: Python :: 3.{minor}' for minor in (11, 12, 13, 14)),
        'Topic :: Scientific/Engineering',
        'Typing :: Typed',
    ],
    # As text, and here: colcon cannot read the object that setuptools makes of a line in setup.cfg.
    python_requires='>=3.11',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: ['py.typed']},
    data_files=[('share/ament_index/resource_index/packages', [f'resource/{NAME}']), *share_files()],
    zip_safe=False,
    entry_points={
        'console_scripts': [
            f'compile = {NAME}.ik.compilation:main',
            f'path = {NAME}.tools.path:main',
            f'reach = {NAME}.tools.reach:main',
            f'compare = {NAME}.compare.command:main',
            f'ik_node = {NAME}.programs:ik_node',
            f'demo = {NAME}.programs:demo',
            f'send_target = {NAME}.programs:send_target',
            f'send_path = {NAME}.programs:send_path',
            f'teleop = {NAME}.programs:teleop',
            f'set_param = {NAME}.programs:set_param',
            f'panel = {NAME}.programs:panel',
        ]
    },
)
