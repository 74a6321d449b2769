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
    maintainer=MANIFEST.findtext('maintainer'),
    license=MANIFEST.findtext('license'),
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: ['py.typed']},
    data_files=[('share/ament_index/resource_index/packages', [f'resource/{NAME}']), *share_files()],
    zip_safe=False,
    entry_points={
        'console_scripts': [
            f'ik_node = {NAME}.ros.ik_node:main',
            f'compile = {NAME}.ik.compilation:main',
            f'demo = {NAME}.tools.demo:main',
            f'send_target = {NAME}.tools.send_target:main',
            f'path = {NAME}.tools.path:main',
            f'send_path = {NAME}.tools.send_path:main',
            f'teleop = {NAME}.tools.teleop:main',
            f'set_param = {NAME}.tools.set_param:main',
            f'reach = {NAME}.tools.reach:main',
            f'compare = {NAME}.compare.command:main',
            f'panel = {NAME}.panel.panel_node:main',
        ]
    },
)
