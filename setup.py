"""Package description for ament_python and pip; requirements are in setup.cfg."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = 'ros_ik_pkg'


def share_files():
    """Return (folder, files) for what is installed beside the code, its folders kept."""
    folders = {Path('.'): [Path('package.xml')]}
    for top in ('config', 'launch'):
        for path in sorted(Path(top).rglob('*')):
            if path.is_file() and '__pycache__' not in path.parts:
                folders.setdefault(path.parent, []).append(path)
    return [(str(Path('share', NAME) / folder), list(map(str, files))) for folder, files in folders.items()]


setup(
    name=NAME,
    version='0.1.0',
    description='ROS 2 inverse kinematics with five Jacobian methods, every iteration visible',
    author='ros_ik_pkg maintainers',
    author_email='maintainers@ros-ik-pkg.example',
    maintainer='ros_ik_pkg maintainers',
    maintainer_email='maintainers@ros-ik-pkg.example',
    license='Apache-2.0',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    data_files=[('share/ament_index/resource_index/packages', [f'resource/{NAME}']), *share_files()],
    zip_safe=False,
    entry_points={
        'console_scripts': [
            f'ik_node = {NAME}.ros.ik_node:main',
            f'demo = {NAME}.tools.demo:main',
            f'send_target = {NAME}.tools.send_target:main',
            f'set_param = {NAME}.tools.set_param:main',
            f'compare = {NAME}.compare.command:main',
            f'panel = {NAME}.panel.panel_node:main',
        ]
    },
)
