"""The fields of MoveIt's planning scene and of its kinematics services, as moveit_msgs of Jazzy has them.

Names, types and order of fields and constants decide the encoding; without comments and defaults, which do not.
"""

from __future__ import annotations

OBJECT_RECOGNITION_MSGS = {'msg/ObjectType': 'string key; string db'}
OCTOMAP_MSGS = {
    'msg/Octomap': 'std_msgs/Header header; bool binary; string id; float64 resolution; int8[] data',
    'msg/OctomapWithPose': 'std_msgs/Header header; geometry_msgs/Pose origin; octomap_msgs/Octomap octomap',
}
CODES = (
    'SUCCESS=1 UNDEFINED=0 FAILURE=99999 PLANNING_FAILED=-1 INVALID_MOTION_PLAN=-2 '
    'MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE=-3 CONTROL_FAILED=-4 UNABLE_TO_AQUIRE_SENSOR_DATA=-5 TIMED_OUT=-6 '
    'PREEMPTED=-7 START_STATE_IN_COLLISION=-10 START_STATE_VIOLATES_PATH_CONSTRAINTS=-11 START_STATE_INVALID=-26 '
    'GOAL_IN_COLLISION=-12 GOAL_VIOLATES_PATH_CONSTRAINTS=-13 GOAL_CONSTRAINTS_VIOLATED=-14 GOAL_STATE_INVALID=-27 '
    'UNRECOGNIZED_GOAL_TYPE=-28 INVALID_GROUP_NAME=-15 INVALID_GOAL_CONSTRAINTS=-16 INVALID_ROBOT_STATE=-17 '
    'INVALID_LINK_NAME=-18 INVALID_OBJECT_NAME=-19 FRAME_TRANSFORM_FAILURE=-21 COLLISION_CHECKING_UNAVAILABLE=-22 '
    'ROBOT_STATE_STALE=-23 SENSOR_INFO_STALE=-24 COMMUNICATION_FAILURE=-25 CRASH=-29 ABORT=-30 NO_IK_SOLUTION=-31'
)
MOVEIT_MSGS = {
    'msg/MoveItErrorCodes': '; '.join(f'int32 {code}' for code in CODES.split())
    + '; int32 val; string message; string source',
    'msg/CollisionObject': 'std_msgs/Header header; geometry_msgs/Pose pose; string id; '
    'object_recognition_msgs/ObjectType type; shape_msgs/SolidPrimitive[] primitives; '
    'geometry_msgs/Pose[] primitive_poses; shape_msgs/Mesh[] meshes; geometry_msgs/Pose[] mesh_poses; '
    'shape_msgs/Plane[] planes; geometry_msgs/Pose[] plane_poses; string[] subframe_names; '
    'geometry_msgs/Pose[] subframe_poses; byte ADD=0; byte REMOVE=1; byte APPEND=2; byte MOVE=3; byte operation',
    'msg/AttachedCollisionObject': 'string link_name; CollisionObject object; string[] touch_links; '
    'trajectory_msgs/JointTrajectory detach_posture; float64 weight',
    'msg/RobotState': 'sensor_msgs/JointState joint_state; sensor_msgs/MultiDOFJointState multi_dof_joint_state; '
    'AttachedCollisionObject[] attached_collision_objects; bool is_diff',
    'msg/AllowedCollisionEntry': 'bool[] enabled',
    'msg/AllowedCollisionMatrix': 'string[] entry_names; AllowedCollisionEntry[] entry_values; '
    'string[] default_entry_names; bool[] default_entry_values',
    'msg/LinkPadding': 'string link_name; float64 padding',
    'msg/LinkScale': 'string link_name; float64 scale',
    'msg/ObjectColor': 'string id; std_msgs/ColorRGBA color',
    'msg/PlanningSceneWorld': 'CollisionObject[] collision_objects; octomap_msgs/OctomapWithPose octomap',
    'msg/PlanningScene': 'string name; RobotState robot_state; string robot_model_name; '
    'geometry_msgs/TransformStamped[] fixed_frame_transforms; AllowedCollisionMatrix allowed_collision_matrix; '
    'LinkPadding[] link_padding; LinkScale[] link_scale; ObjectColor[] object_colors; PlanningSceneWorld world; '
    'bool is_diff',
    'msg/BoundingVolume': 'shape_msgs/SolidPrimitive[] primitives; geometry_msgs/Pose[] primitive_poses; '
    'shape_msgs/Mesh[] meshes; geometry_msgs/Pose[] mesh_poses',
    'msg/JointConstraint': 'string joint_name; float64 position; float64 tolerance_above; float64 tolerance_below; '
    'float64 weight',
    'msg/PositionConstraint': 'std_msgs/Header header; string link_name; geometry_msgs/Vector3 target_point_offset; '
    'BoundingVolume constraint_region; float64 weight',
    'msg/OrientationConstraint': 'std_msgs/Header header; geometry_msgs/Quaternion orientation; string link_name; '
    'float64 absolute_x_axis_tolerance; float64 absolute_y_axis_tolerance; float64 absolute_z_axis_tolerance; '
    'uint8 parameterization; uint8 XYZ_EULER_ANGLES=0; uint8 ROTATION_VECTOR=1; float64 weight',
    'msg/VisibilityConstraint': 'float64 target_radius; geometry_msgs/PoseStamped target_pose; int32 cone_sides; '
    'geometry_msgs/PoseStamped sensor_pose; float64 max_view_angle; float64 max_range_angle; uint8 SENSOR_Z=0; '
    'uint8 SENSOR_Y=1; uint8 SENSOR_X=2; uint8 sensor_view_direction; float64 weight',
    'msg/Constraints': 'string name; JointConstraint[] joint_constraints; PositionConstraint[] position_constraints; '
    'OrientationConstraint[] orientation_constraints; VisibilityConstraint[] visibility_constraints',
    'msg/PositionIKRequest': 'string group_name; RobotState robot_state; Constraints constraints; '
    'bool avoid_collisions; string ik_link_name; geometry_msgs/PoseStamped pose_stamped; string[] ik_link_names; '
    'geometry_msgs/PoseStamped[] pose_stamped_vector; builtin_interfaces/Duration timeout',
    'srv/GetPositionIK': 'PositionIKRequest ik_request; ---; RobotState solution; MoveItErrorCodes error_code',
    'srv/GetPositionFK': 'std_msgs/Header header; string[] fk_link_names; RobotState robot_state; ---; '
    'geometry_msgs/PoseStamped[] pose_stamped; string[] fk_link_names; MoveItErrorCodes error_code',
}
PACKAGES = {
    'object_recognition_msgs': OBJECT_RECOGNITION_MSGS, 'octomap_msgs': OCTOMAP_MSGS, 'moveit_msgs': MOVEIT_MSGS,
}  # in the order of use
