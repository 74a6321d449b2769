"""What goes out is clear of the robot itself and of the room, or nothing goes out; without DDS."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.clock import ROSClock
from ros_helpers import CALM, joint_state, target_of
from visualization_msgs.msg import Marker, MarkerArray

from bench.published_robots import BAXTER, PANDA, UR5, configurations
from ros_ik_pkg.ik import ModelError, SolveOptions, load_arm
from ros_ik_pkg.ik.search.entry import FIGURES
from ros_ik_pkg.ros.handling.final_check import contact_of
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.robot_source import RobotSource
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings
from ros_ik_pkg.ros.output.contact_markers import contact_markers
from ros_ik_pkg.ros.output.statuses import result_message

ARM = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])
TABLE = "obstacles: [{name: table, box: [2.0, 2.0, 0.1], xyz: [0.0, 0.0, -0.1]}]"


def settings(**values) -> Settings:
    defaults = {name: option.default for name, option in PARAMETERS.items()}
    return Settings.from_values(defaults | CALM | {'seed_source': 'home'} | values)


def handler_with(arm=ARM, **values) -> TargetHandler:
    frames = SimpleNamespace(set_timeout=lambda timeout: None, why_not='TF is not asked here')
    handler = TargetHandler(ROSClock(), frames, JointStates(), lambda: 'no robot yet')
    found = settings(**values)
    handler.surroundings.read(found)
    handler.take_over(found, arm)
    return handler


def marker(x, y, z, size=0.1, action=Marker.ADD, frame=''):
    found = Marker(ns='room', type=Marker.SPHERE, action=action)
    found.header.frame_id = frame
    found.scale.x = found.scale.y = found.scale.z = size
    found.pose.position.x, found.pose.position.y, found.pose.position.z = float(x), float(y), float(z)
    found.pose.orientation.w = 1.0
    return MarkerArray(markers=[found])


@pytest.mark.parametrize('room', [{'ground': -0.05}, {'obstacles_file': TABLE}], ids=['ground', 'obstacles_file'])
def test_what_goes_out_is_clear_of_the_room(room):
    handler, heedless = handler_with(**room), handler_with(avoid_collisions=False)
    world = handler.surroundings.world(ARM, handler.settings)[0]
    below = 0
    for q in configurations(ARM, 60):
        target = target_of(ARM.forward(q))
        result, other = handler.handle(target, trace=False), heedless.handle(target, trace=False)
        below += other.command is not None and not ARM.contacts.is_clear(other.command.q, 0.0, world)
        if result.command is not None:
            assert ARM.contacts.is_clear(result.command.q, 0.0, world)
        else:
            assert result.status == 'collision', result.reason
    assert below > 3


def test_an_obstacle_on_the_target_fails_with_the_names_and_goes_away_again():
    handler = handler_with()
    target = ARM.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2]))
    assert handler.take_obstacles(marker(*target[:3, 3])) == []
    result = handler.handle(target_of(target), trace=False)
    assert (result.outcome, result.status) == ('failed', 'collision') and result.command is None
    assert 'room/0' in result.reason and 'mm deep' in result.reason
    handler.take_obstacles(marker(0, 0, 0, action=Marker.DELETE))
    assert handler.handle(target_of(target), trace=False).outcome == 'solved'


def test_out_of_reach_closest_does_not_lead_into_contact():
    handler = handler_with(out_of_reach='closest')
    target = ARM.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2]))
    handler.take_obstacles(marker(*target[:3, 3]))
    assert handler.handle(target_of(target), trace=False).command is None
    far = target.copy()
    far[:3, 3] *= 10.0
    ground = handler_with(out_of_reach='closest', ground=0.3 * target[2, 3])
    for height in (-3.0, -1.0, 1.0):
        far[2, 3] = height
        result = ground.handle(target_of(far), trace=False)
        if result.command is not None:
            assert ARM.contacts.is_clear(result.command.q, 0.0, ground.surroundings.world(ARM, ground.settings)[0])


def test_an_obstacle_is_placed_in_the_frame_of_a_link():
    handler = handler_with()
    q = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
    handler.joint_states.keep(joint_state(ARM.joint_names, q))
    assert handler.take_obstacles(marker(0, 0, 0.5, frame='wrist_3_link')) == []
    (obstacle,) = handler.surroundings.markers.current()
    expected = ARM.base_from_frame('wrist_3_link', dict(zip(ARM.joint_names, q))) @ [0, 0, 0.5, 1]
    assert np.allclose(obstacle.shape.frame_from_shape[:3, 3], expected[:3])
    assert 'no_such' in handler.take_obstacles(marker(0, 0, 0, frame='no_such'))[0]


def test_a_marker_that_is_locked_to_the_tip_is_carried_along():
    handler = handler_with()
    held = marker(0.1, 0, 0, size=0.05, frame=UR5[2])
    assert 'moves with the tip' in handler.take_obstacles(held)[0]
    held.markers[0].frame_locked = True
    assert handler.take_obstacles(held) == []
    world = handler.surroundings.newest(ARM, handler.settings)
    assert [obstacle.link for obstacle in world.obstacles] == [UR5[2]]
    free, carrying = ARM.contacts.room(), ARM.contacts.room(world)
    touching = [q for q in configurations(ARM, 1000) if free.is_clear(q) and not carrying.is_clear(q)]
    assert touching and all('room/0' in carrying.look(q).links for q in touching)


def test_obstacles_that_come_before_the_robot_count_when_it_is_there():
    handler = handler_with(arm=None)
    target = ARM.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2]))
    assert handler.take_obstacles(marker(*target[:3, 3])) == []
    assert handler.take_obstacles(marker(0, 0, 0, frame='no_such')) == []
    (reason,) = handler.take_over(handler.parameters, ARM)
    assert 'no_such' in reason
    result = handler.handle(target_of(target), trace=False)
    assert result.status == 'collision' and 'room/0' in result.reason


def test_obstacles_stay_where_they_are_when_the_base_frame_is_another():
    handler = handler_with()
    q = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
    place = ARM.forward(q)[:3, 3]
    handler.take_obstacles(marker(*place))
    other = load_arm(UR5[0], base='shoulder_link', tip=UR5[2], srdf=UR5[1])
    handler.joint_states.keep(joint_state(ARM.joint_names, q))
    assert handler.take_over(handler.parameters, other) == []
    (obstacle,) = handler.surroundings.markers.current()
    assert np.allclose(obstacle.shape.frame_from_shape[:3, 3], other.forward(q[1:])[:3, 3])


def test_obstacles_in_the_base_frame_of_another_robot_are_left_aside_with_a_reason():
    handler = handler_with()
    handler.take_obstacles(marker(0.5, 0, 0.5))
    (reason,) = handler.take_over(handler.parameters, load_arm(PANDA[0], tip=PANDA[2], srdf=PANDA[1]))
    assert ARM.base_frame in reason and handler.surroundings.markers.current() == ()


def test_another_robot_is_taken_over_without_a_word_if_there_were_no_obstacles():
    handler = handler_with()
    assert handler.take_obstacles(marker(0.4, 0, 0)) == []
    assert handler.take_obstacles(marker(0, 0, 0, action=Marker.DELETEALL)) == []
    assert handler.take_over(handler.parameters, load_arm('panda')) == []


def test_a_floor_through_the_base_is_refused_with_the_reason_and_the_next_target_is_right():
    handler = handler_with(ground=0.5)
    target = target_of(ARM.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])))
    result = handler.handle(target, trace=False)
    assert result.outcome == 'refused' and 'in every configuration' in result.reason and 'floor' in result.reason
    handler.take_over(settings(), ARM)
    assert handler.handle(target, trace=False).outcome == 'solved'


def test_an_obstacles_file_that_makes_no_sense_is_refused():
    with pytest.raises(ModelError, match='expected the key obstacles'):
        handler_with(obstacles_file='a: 1')


def test_a_step_into_contact_is_not_published_and_one_out_of_it_is():
    room = ARM.contacts.room()
    q = configurations(ARM, 400, seed=2)
    options = SolveOptions()
    touching = [row for row in q if not room.is_clear(row)]
    clear = next(row for row in q if room.is_clear(row, 0.001))
    for row in touching[:5]:
        assert 'touch' in contact_of(row, clear, room, options)
        assert contact_of(clear, row, room, options) == ''
        contact = contact_of(row, None, room, options)
        assert 'mm deep' in contact and ' and ' in contact
    assert contact_of(touching[0], None, None, options) == ''


def test_check_motion_looks_at_the_whole_line():
    room = ARM.contacts.room()
    q = configurations(ARM, 300, seed=3)
    clear = [row for row in q if room.is_clear(row, 0.01)]
    options, through = SolveOptions(), []
    for start, goal in pairwise(clear):
        line = np.linspace(start, goal, 200)
        if any(not room.is_clear(row) for row in line):
            through.append(contact_of(goal, start, room, options, whole_motion=True))
            assert contact_of(goal, start, room, options) == ''
    assert len(through) > 5 and np.mean([bool(found) for found in through]) > 0.9
    assert 'on the way there' in next(filter(None, through))


def test_an_answer_that_touches_whatever_the_search_says_does_not_pass(monkeypatch):
    handler = handler_with()
    q = next(row for row in configurations(ARM, 500, seed=4) if not ARM.contacts.is_clear(row))
    from ros_ik_pkg.ros.handling import target_handler

    def wrong(arm, target, *_):
        solution = target_handler_solve(arm, target, q, SolveOptions(avoid_collisions=False))
        solution.room = arm.contacts.room()
        return solution

    target_handler_solve = target_handler.solve
    monkeypatch.setattr(target_handler, 'solve', wrong)
    result = handler.handle(target_of(ARM.forward(q)), trace=False)
    assert result.status == 'internal_error' and 'mm deep' in result.reason and result.command is None
    assert len(FIGURES) + ARM.n == len(result.solution.row)


def test_joints_outside_the_chain_are_where_the_joint_states_have_them():
    arm = load_arm(BAXTER[0], base='torso', tip='left_hand_link', srdf=BAXTER[1])
    handler = handler_with(arm)
    world, notes = handler.surroundings.world(arm, handler.settings)
    assert 'right_s0' in notes[0] and not world.positions
    assert handler.surroundings.world(arm, handler.settings) == (world, ())  # nothing has changed
    outside = arm.contacts.outside
    assert 'right_s0' in outside and 'left_s0' not in outside
    handler.joint_states.keep(joint_state(outside, np.full(len(outside), 0.01)))
    moved, _ = handler.surroundings.world(arm, handler.settings)
    assert moved is not world and moved.positions['right_s0'] == 0.01
    assert arm.contacts.room(moved).positions['right_s0'] == 0.01


def test_the_srdf_of_the_topic_counts_and_one_of_another_robot_is_left_aside():
    source = RobotSource('/robot_description')
    panda = settings(robot=str(PANDA[0]), tip_frame=PANDA[2])
    source.semantic = PANDA[1].read_text()
    assert source.load(panda).contacts.left_out[0].reason.startswith('SRDF')
    source.semantic = UR5[1].read_text()
    assert not source.load(panda).contacts.left_out[0].reason.startswith('SRDF')
    assert "for robot 'ur5'" in source.semantic_fault
    named = replace(panda, srdf=str(PANDA[1]))
    assert source.load(named).contacts.left_out[0].reason.startswith('SRDF') and source.semantic_fault == ''


def test_results_and_markers_tell_the_clearance():
    handler = handler_with()
    result = handler.handle(target_of(ARM.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2]))), trace=False)
    figures = {value.key: value.value for value in result_message(result, 'node').status[0].values}
    assert 0.0 < float(figures['clearance']) <= result.solution.clearance + 1e-6
    points, line, text = contact_markers(result).markers
    gap = np.array([[point.x, point.y, point.z] for point in points.points])
    assert np.linalg.norm(gap[0] - gap[1]) == pytest.approx(result.solution.clearance, abs=1e-6)
    assert len(line.points) == 2 and all(name in text.text for name in result.solution.nearest_links)
    assert line.color.b > line.color.r
