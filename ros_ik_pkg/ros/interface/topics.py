"""Every topic of the node in one table: name, type, direction, QoS and text."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseStamped, TransformStamped, TwistStamped
from nav_msgs.msg import Path
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

NODE_NAME = 'ik_node'
PAUSE = '~/pause'  # the service, std_srvs/SetBool
MAP_REACH = '~/map_reach'  # the service, std_srvs/Trigger
COMPUTE_IK = '~/compute_ik'  # the service, moveit_msgs/GetPositionIK
COMPUTE_FK = '~/compute_fk'  # the service, moveit_msgs/GetPositionFK
# The policies that the parameters qos_overrides.<topic>.<publisher or subscription>.<policy> set at the start.
OVERRIDABLE = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)
HEARS_ALL = {'RELIABILITY': 'best_effort', 'DURABILITY': 'volatile'}  # of a subscription


@dataclass(frozen=True)
class Topic:
    """One topic; `~/` names belong to the node, the others are shared and may be remapped."""

    name: str
    type: Any
    direction: str
    text: str
    depth: int = 1
    best_effort: bool = False
    latched: bool = False

    @property
    def qos(self) -> QoSProfile:
        """Quality of service, reliable and volatile unless declared otherwise."""
        return QoSProfile(
            depth=self.depth,
            reliability=ReliabilityPolicy.BEST_EFFORT if self.best_effort else ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if self.latched else DurabilityPolicy.VOLATILE,
        )

    def of(self, node: str) -> str:
        """Return the full name of the topic of the node with this full name, such as /left/ik_node."""
        if self.name.startswith('~/'):
            return node + self.name[1:]
        return self.name if self.name.startswith('/') else f'{node.rpartition("/")[0]}/{self.name}'


SCENE = {
    'planning_scene': ('PlanningScene', 'obstacles and held objects, as MoveIt has them'),
    'collision_object': ('CollisionObject', 'one obstacle, as MoveIt has it'),
    'attached_collision_object': ('AttachedCollisionObject', 'one held object, as MoveIt has it'),
}


def _planning_scene_topics() -> tuple[Topic, ...]:
    """Return the topics of MoveIt's planning scene whose messages are installed: none without moveit_msgs."""
    try:
        messages = import_module('moveit_msgs.msg')
    except ImportError:
        return ()
    return tuple(Topic(name, getattr(messages, kind), 'in', text, 100)
                 for name, (kind, text) in SCENE.items() if hasattr(messages, kind))


TARGET_POSE = Topic('target_pose', PoseStamped, 'in', 'desired pose of the tip; only the newest one waits')
FIRST_TARGET_POSE = Topic(
    'first_target_pose', PoseStamped, 'in',
    'where the first of tip_frames is wanted; in the frame of the second: relative to it',
)
SECOND_TARGET_POSE = Topic('second_target_pose', PoseStamped, 'in', 'where the second of tip_frames is wanted')
TARGET_TWIST = Topic(
    'target_twist',
    TwistStamped,
    'in',
    'how the tip moves, in the axes of frame_id; followed if command_rate is above 0',
)
JOINT_STATES = Topic(
    'joint_states',
    JointState,
    'in',
    'joint positions by name, any order, extra joints ignored',
    best_effort=True,
)
ROBOT_DESCRIPTION = Topic(
    'robot_description', String, 'in', 'URDF, used when the parameters name no robot', latched=True
)
ROBOT_DESCRIPTION_SEMANTIC = Topic(
    'robot_description_semantic', String, 'in', 'SRDF, used when the parameter srdf is empty', latched=True
)
OBSTACLES = Topic(
    'obstacles', MarkerArray, 'in', 'boxes, spheres and cylinders that the arm must stay clear of', depth=100
)
TOOL = Topic(
    'tool', TransformStamped, 'in', 'the tool on the tip frame, its frame named by child_frame_id; sets the parameter',
    latched=True,
)
TOOL_POSE = Topic('tool_pose', PoseStamped, 'in', 'the same as a pose in the tip frame', latched=True)
PLANNING_SCENE_TOPICS = _planning_scene_topics()
CONTACTS = Topic('~/contacts', MarkerArray, 'out', 'the two nearest points of an answer, red if they touch', depth=10)
SOLUTION = Topic(
    '~/solution', JointState, 'out', 'answers within tolerance and limits; what else, parameters must ask for', depth=10
)
JOINT_TRAJECTORY = Topic(
    '~/joint_trajectory', JointTrajectory, 'out', 'the same as a point for joint_trajectory_controller'
)
POSITION_COMMANDS = Topic(
    '~/position_commands', Float64MultiArray, 'out', 'the same, positions alone, for forward_command_controller'
)
SERVO_STATUS = Topic(
    '~/servo_status', DiagnosticArray, 'out', 'one status of the stream of commands: a code and why'
)
RESULT = Topic(
    '~/result', DiagnosticArray, 'out', 'one status for every target: solved, failed or refused', depth=100
)
ITERATIONS = Topic('~/iterations', DiagnosticArray, 'out', 'one status per iteration, for people', depth=10)
TRACE = Topic('~/trace', Float64MultiArray, 'out', 'the same as a matrix with labelled columns', depth=10)
TCP_PATH = Topic('~/tcp_path', Path, 'out', 'where the tip was at each iteration', depth=10)
COMPARISON = Topic('~/comparison', DiagnosticArray, 'out', 'one status for each method that is compared', depth=10)
COMPARISON_PATHS = Topic(
    '~/comparison_paths', MarkerArray, 'out', 'where the tip was with each method, for RViz', depth=10
)
TARGET_PATH = Topic(
    'target_path', Path, 'in', 'poses that the tip moves through in straight lines; a new path replaces the last one'
)
PATH_SOLUTION = Topic(
    '~/path_solution', JointTrajectory, 'out', 'the motion along a solved path, for joint_trajectory_controller',
    depth=10,
)
PATH_RESULT = Topic(
    '~/path_result', DiagnosticArray, 'out', 'one status for every path: solved, partial, failed or refused', depth=10
)
PATH_MARKERS = Topic(
    '~/path_markers', MarkerArray, 'out', 'the line of the tip, coloured by speed and by singularity, for RViz',
    depth=10,
)
REACH = Topic(
    '~/reach', MarkerArray, 'out',
    'what the arm reaches, red to blue: share of the rotations, sigma_min, clearance; after ~/map_reach',
    latched=True,
)
REACH_POSES = Topic(
    '~/reach_poses', PoseArray, 'out',
    'a pose of the tip for each point of ~/reach, in the same order, far from singular', latched=True,
)
DIAGNOSTICS = Topic('/diagnostics', DiagnosticArray, 'out', 'health of the node, once a second')

TOPICS = (
    TARGET_POSE,
    FIRST_TARGET_POSE,
    SECOND_TARGET_POSE,
    TARGET_TWIST,
    JOINT_STATES,
    ROBOT_DESCRIPTION,
    ROBOT_DESCRIPTION_SEMANTIC,
    OBSTACLES,
    TOOL,
    TOOL_POSE,
    SOLUTION,
    JOINT_TRAJECTORY,
    POSITION_COMMANDS,
    SERVO_STATUS,
    RESULT,
    ITERATIONS,
    TRACE,
    TCP_PATH,
    COMPARISON,
    COMPARISON_PATHS,
    CONTACTS,
    TARGET_PATH,
    PATH_SOLUTION,
    PATH_RESULT,
    PATH_MARKERS,
    REACH,
    REACH_POSES,
    DIAGNOSTICS,
)


def advice_on_qos(topic: str, policy: str) -> str:
    """Return a warning that a publisher of a topic (full name) is not heard because of a policy, with the remedy."""
    text = f'a publisher of {topic} is not heard: its {policy.lower()} is less than this node asks for'
    if policy not in HEARS_ALL:
        return text
    return f'{text}; start the node with -p qos_overrides.{topic}.subscription.{policy.lower()}:={HEARS_ALL[policy]}'
