"""Where the arm comes from: a parameter or the latched robot_description topic."""

from __future__ import annotations

from ros_ik_pkg.ik import Arm, ModelError, load_arm
from ros_ik_pkg.ik.arm import parse_held
from ros_ik_pkg.ik.model.sources import parse_xacro_args, read_tree
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.interface.parameters import Settings

TOPIC = 'topic robot_description'


class RobotSource:
    """Loads the arm that the settings mean: robot_description, else robot, else the topic."""

    def __init__(self) -> None:
        self.topic_text = ''  # the last that was URDF

    def take(self, text: str) -> None:
        """Use a text of the topic from now on; raise ModelError, and keep the one before, where it is no URDF."""
        try:
            read_tree(urdf_text(text, 'the text'))
        except ModelError as error:
            raise ModelError(f'{TOPIC}: {error}') from error
        self.topic_text = text

    def load(self, settings: Settings) -> Arm | None:
        """Return the arm, or None while the topic is awaited; raise ModelError that names topic and parameters."""
        source = settings.robot or self.topic_text
        if settings.robot_description:
            source = urdf_text(settings.robot_description, 'parameter robot_description')
        if not source:
            return None
        try:
            return load_arm(
                source, settings.base_frame or None, settings.tip_frame or None, limits=settings.limits,
                joint_limits=settings.joint_limits, held=parse_held(settings.held_joints),
                xacro_args=parse_xacro_args(settings.xacro_args))
        except ModelError as error:
            raise ModelError(f'{_described(settings)}: {error}') from error


def follows_topic(settings: Settings) -> bool:
    """Whether the arm is the one of the robot_description topic."""
    return not settings.robot and not settings.robot_description


def urdf_text(text: str, origin: str) -> str:
    """Return URDF text as it is; refuse a name or path, so that no text from outside opens files."""
    if not text.lstrip('\ufeff \t\r\n').startswith('<'):
        raise ModelError(f'{origin} is {shorten(text, 60)!r}; expected URDF text, which starts with <')
    return text


def _described(settings: Settings) -> str:
    """Name what a model error can come from."""
    robot = f'robot = {shorten(settings.robot, 60)!r}' if settings.robot else TOPIC
    if settings.robot_description:
        robot = 'parameter robot_description'
    frames = [f'{name} = {getattr(settings, name)!r}' for name in ('base_frame', 'tip_frame')]
    return ', '.join([robot, *(text for text in frames if not text.endswith("''"))])
