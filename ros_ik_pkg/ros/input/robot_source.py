"""The source of the arm: a parameter or the latched robot_description topic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from ros_ik_pkg.ik import Arm, ArmTree, IkError, ModelError, OptionError, load_arm, load_tree
from ros_ik_pkg.ik.model.joint_limits import parse_held
from ros_ik_pkg.ik.model.sources import parse_xacro_args, read_tree
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.interface.parameters import Settings

Robot = TypeVar('Robot', Arm, ArmTree)


class RobotSource:
    """Loads the arm of the settings: from robot_description, else robot, else the topic with this full name."""

    def __init__(self, topic: str) -> None:
        self._topic = f'topic {topic}'
        self.topic_text = ''  # the last valid URDF
        self.rejected = ''  # why the newest text of the topic is not used
        self.semantic = ''  # SRDF of its topic
        self.semantic_fault = ''  # why it is not used

    def take(self, text: str) -> str:
        """Use a text of the topic from now on and return its robot's name; raise ModelError if it is not URDF.

        After an error the previous text is kept, and the error is in `rejected`.
        """
        try:
            tree = read_tree(urdf_text(text, 'the text'))
        except ModelError as error:
            raise self.reject(ModelError(f'{self._topic}: {error}')) from error
        self.topic_text, self.rejected = text, ''
        return tree.name

    def reject(self, error: IkError) -> IkError:
        """Keep and return the error with which the newest text of the topic was rejected."""
        self.rejected = shorten(str(error), 1000)
        return error

    def load(self, settings: Settings) -> Arm | None:
        """Return the arm, or None while the topic is awaited; raise ModelError that names topic and parameters."""
        tip = settings.tip_frame or (settings.tip_frames[0] if settings.tip_frames else None)
        return self._load(settings, lambda source, **others: load_arm(source, tip=tip, **others))

    def load_tips(self, settings: Settings) -> ArmTree | None:
        """Return both arms of tip_frames, or None if there are none or no robot; raise as `load`."""
        if not settings.tip_frames:
            return None
        return self._load(settings, lambda source, **others: load_tree(source, settings.tip_frames, **others))

    def _load(self, settings: Settings, load: Callable[..., Robot]) -> Robot | None:
        """Return what `load` loads from the source of the settings."""
        source = settings.robot or self.topic_text
        if settings.robot_description:
            source = urdf_text(settings.robot_description, 'parameter robot_description')
        if not source:
            return None
        try:
            arm = load(
                source, base=settings.base_frame or None, limits=settings.limits, joint_limits=settings.joint_limits,
                held=parse_held(settings.held_joints), xacro_args=parse_xacro_args(settings.xacro_args),
                srdf=settings.srdf or None)
            return self._with_semantic(arm, settings)
        except ModelError as error:
            raise ModelError(f'{self._described(settings)}: {error}') from error

    def _with_semantic(self, arm: Robot, settings: Settings) -> Robot:
        """Return the arm with the SRDF of the topic, if no parameter names one and it is for this robot."""
        self.semantic_fault = ''
        if settings.srdf or not self.semantic or not settings.options.avoid_collisions:
            return arm
        try:
            with_srdf = replace(arm, srdf=self.semantic)
            _ = with_srdf.contacts
        except ModelError as error:
            self.semantic_fault = shorten(f'robot_description_semantic is not used: {error}', 1000)
            return arm
        return with_srdf

    def awaited(self) -> str:
        """Return why there is no robot if no parameter names one."""
        if self.rejected:
            return f'no robot yet: {self.rejected}'
        return f'no robot yet: no URDF came on {self._topic}, and the parameters robot and robot_description are empty'

    def ignored(self, name: str, settings: Settings) -> str:
        """Return a warning that the robot of the topic with this name is ignored, and how to follow it."""
        parameter = 'robot_description' if settings.robot_description else 'robot'
        value = '' if settings.robot_description else f' = {shorten(settings.robot, 60)!r}'
        return (
            f'robot {name!r} on {self._topic} is ignored: parameter {parameter}{value} comes first; to follow the '
            "topic, set robot and robot_description to ''"
        )

    def _described(self, settings: Settings) -> str:
        """Return in words the parameters that may have caused a model error."""
        robot = f'robot = {shorten(settings.robot, 60)!r}' if settings.robot else self._topic
        if settings.robot_description:
            robot = 'parameter robot_description'
        names = ('base_frame', 'tip_frame', 'tip_frames')
        frames = [f'{name} = {value!r}' for name in names if (value := getattr(settings, name))]
        return ', '.join([robot, *frames])


def follows_topic(settings: Settings) -> bool:
    """Whether the arm is the one of the robot_description topic."""
    return not settings.robot and not settings.robot_description


def urdf_text(text: str, origin: str) -> str:
    """Return URDF text unchanged; refuse a name or path, so that no text from outside opens files."""
    if not text.lstrip('\ufeff \t\r\n').startswith('<'):
        raise ModelError(f'{origin} is {shorten(text, 60)!r}; expected URDF text, which starts with <')
    return text


def check_options(settings: Settings, arm: Arm, arm_changes: bool) -> None:
    """Refuse an objective without effect, and lists whose length is not the number of joints; if the arm changes, say
    what to do."""
    if settings.options.null_space == 'clearance' and not settings.options.avoid_collisions:
        raise OptionError('null_space is clearance; that needs avoid_collisions: true')
    try:
        settings.options.check_lengths(arm.n)
    except OptionError as error:
        way_out = ': for another robot set posture and joint_weights to [] before or in the same call'
        raise OptionError(f'robot {arm.name!r}: {error}{way_out if arm_changes else ""}') from error
