"""MoveIt's planning scene as obstacles: what is added, removed and held; the messages by their fields."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from geometry_msgs.msg import Pose
from shape_msgs.msg import Mesh, SolidPrimitive
from std_msgs.msg import Header

from ros_ik_pkg.ik.model.transforms import transform
from ros_ik_pkg.ros.input.planning_scene import ADD, APPEND, MOVE, REMOVE, SceneObjects
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.interface import topics

BOX = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.2, 0.3])
ROLLER = SolidPrimitive(type=SolidPrimitive.CYLINDER, dimensions=[0.5, 0.02])  # height and radius
LINKS = ('base', 'hand', 'finger')


def pose_at(x=0.0, y=0.0, z=0.0, w=1.0):
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z, pose.orientation.w = x, y, z, w
    return pose


def item(name='table', primitives=(BOX,), operation=ADD, frame='base', poses=None, **fields):
    """Return a CollisionObject, by its fields."""
    return SimpleNamespace(**{
        'header': Header(frame_id=frame), 'id': name, 'operation': operation, 'primitives': list(primitives),
        'primitive_poses': [pose_at(0.5) for _ in primitives] if poses is None else poses, 'pose': pose_at(w=0.0),
        'meshes': [], 'planes': [], **fields,
    })  # fmt: skip


def held(link='hand', touches=(), **fields):
    return SimpleNamespace(object=item(frame=link, **fields), link_name=link, touch_links=list(touches))


def scene(objects=(), attached=(), is_diff=True):
    return SimpleNamespace(
        is_diff=is_diff, world=SimpleNamespace(collision_objects=list(objects)),
        robot_state=SimpleNamespace(attached_collision_objects=list(attached), is_diff=is_diff),
    )  # fmt: skip


def place(header):
    if header.frame_id == 'nowhere':
        raise RefusedError('frame', 'frame nowhere is not known')
    return transform(np.eye(3), np.array([0.0, 0.0, 1.0 if header.frame_id == 'shelf' else 0.0]))


@pytest.fixture
def objects():
    return SceneObjects()


def names(objects):
    return [obstacle.name for obstacle in objects.current()]


def test_an_object_stands_where_frame_object_and_primitive_put_it(objects):
    assert objects.take(item(frame='shelf', pose=pose_at(y=2.0)), place, LINKS) == []
    (obstacle,) = objects.current()
    assert obstacle.kind == 'box' and obstacle.size == (0.1, 0.2, 0.3) and obstacle.link == ''
    np.testing.assert_allclose(obstacle.shape.frame_from_shape[:3, 3], [0.5, 2.0, 1.0])


def test_a_cylinder_has_its_height_first_in_the_message(objects):
    assert objects.take(item(primitives=[ROLLER]), place, LINKS) == []
    assert objects.current()[0].kind == 'cylinder' and objects.current()[0].size == (0.02, 0.5)


def test_objects_are_replaced_appended_to_and_removed(objects):
    objects.take(item('a'), place, LINKS)
    objects.take(item('a', [BOX, ROLLER]), place, LINKS)
    assert names(objects) == ['object a', 'object a 1']
    objects.take(item('a', operation=APPEND), place, LINKS)
    objects.take(item('b'), place, LINKS)
    assert names(objects) == ['object a', 'object a 1', 'object a 2', 'object b']
    objects.take(item('a', (), REMOVE), place, LINKS)
    assert names(objects) == ['object b']
    objects.take(item('', (), REMOVE), place, LINKS)
    assert names(objects) == []


def test_a_held_object_hangs_on_its_link_and_is_no_longer_in_the_room(objects):
    objects.take(item('cup'), place, LINKS)
    assert objects.take(held(name='cup', touches=['hand', 'finger', 'elsewhere']), place, LINKS) == []
    (obstacle,) = objects.current()
    assert obstacle.link == 'hand' and obstacle.touches == ('finger',)


def test_an_object_that_is_let_go_stays_in_the_room_where_its_link_has_it(objects):
    objects.take(held(name='cup'), place, LINKS)
    (before,) = objects.current()

    def where_the_hand_is(header):
        assert header.frame_id == 'hand'
        return transform(np.eye(3), np.array([0.0, 0.0, 2.0]))

    assert objects.take(held(name='cup', primitives=(), operation=REMOVE), where_the_hand_is, LINKS) == []
    (after,) = objects.current()
    assert (after.link, after.touches) == ('', ())
    np.testing.assert_allclose(after.pose[:3, 3], before.pose[:3, 3] + [0.0, 0.0, 2.0])
    objects.take(item('cup', (), REMOVE), place, LINKS)
    assert names(objects) == []


def test_an_object_whose_place_is_not_known_is_not_let_go(objects):
    objects.take(held(name='cup'), place, LINKS)

    def nowhere(header):
        raise RefusedError('frame', 'no joint states')

    (reason,) = objects.take(held(name='cup', primitives=(), operation=REMOVE), nowhere, LINKS)
    assert 'no joint states' in reason
    assert [obstacle.link for obstacle in objects.current()] == ['hand']


def test_a_held_object_is_not_added_to_the_room_once_more(objects):
    objects.take(held(name='cup'), place, LINKS)
    (reason,) = objects.take(item('cup'), place, LINKS)
    assert 'it is held' in reason and len(objects.current()) == 1


def test_an_object_in_the_frame_of_the_tip_is_left_aside_unless_it_is_attached(objects):
    (reason,) = objects.take(item(frame='hand'), place, LINKS, ('hand',))
    assert "frame 'hand' moves with the tip" in reason and 'AttachedCollisionObject' in reason
    assert objects.take(held(), place, LINKS, ('hand',)) == [] and names(objects)
    assert objects.take(held(operation=REMOVE), place, LINKS, ('hand',)) == []  # let go: it stays where the hand is


def test_objects_stay_where_they_are_when_the_base_frame_moves(objects):
    objects.take(item(), place, LINKS)
    objects.take(held(name='cup'), place, LINKS)
    before = {obstacle.name: obstacle.shape.frame_from_shape for obstacle in objects.current()}
    up = transform(np.eye(3), np.array([0.0, 0.0, 1.0]))
    objects.move(up)
    for obstacle in objects.current():
        expected = before[obstacle.name] if obstacle.link else up @ before[obstacle.name]
        assert np.allclose(obstacle.shape.frame_from_shape, expected)


def test_a_whole_scene_replaces_everything_and_a_difference_adds(objects):
    objects.take(item('old'), place, LINKS)
    assert objects.take(scene([item('new')], [held(name='cup')]), place, LINKS) == []
    assert names(objects) == ['object old', 'object new', 'object cup']
    assert objects.take(scene([item('last')], is_diff=False), place, LINKS) == []
    assert names(objects) == ['object last']


@pytest.mark.parametrize(
    ('wrong', 'reason'),
    [
        (item('bad', [SolidPrimitive(type=SolidPrimitive.CONE, dimensions=[1.0, 1.0])]), 'primitive of type 4'),
        (item('bad', [SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[1.0])]), 'with 1 dimensions'),
        (item('bad', [SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.0, 1.0, 1.0])]), 'bad'),
        (item('bad', [SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[float('nan')])]), 'bad'),
        (item('bad', ()), '0 primitives'),
        (item('bad', poses=[]), '1 primitives and 0 poses'),
        (item('bad', poses=[pose_at(float('nan'))]), 'expected finite numbers'),
        (item('bad', poses=[pose_at(w=0.0)]), 'unit quaternion'),
        (item('bad', meshes=[Mesh()]), 'mesh'),
        (item('bad', frame='nowhere'), 'nowhere is not known'),
        (item('bad', operation=MOVE), 'MOVE'),
        (item('bad', operation=b'\x09'), 'operation'),
        (held('foot', name='bad'), "link_name 'foot' does not exist"),
    ],
)
def test_what_makes_no_sense_is_left_aside_with_a_reason_and_the_others_stay(objects, wrong, reason):
    objects.take(item('good'), place, LINKS)
    (said,) = objects.take(scene([], [wrong]) if hasattr(wrong, 'link_name') else wrong, place, LINKS)
    assert reason in said and "'bad'" in said
    assert names(objects) == ['object good']


def test_more_obstacles_than_count_are_refused(objects, monkeypatch):
    monkeypatch.setattr('ros_ik_pkg.ros.input.planning_scene.MOST_OBSTACLES', 2)
    assert objects.take(item('a', [BOX, BOX]), place, LINKS) == []
    (said,) = objects.take(item('b'), place, LINKS)
    assert 'more than 2 obstacles' in said
    assert names(objects) == ['object a', 'object a 1']


KINDS = 'PlanningScene', 'CollisionObject', 'AttachedCollisionObject'


@pytest.mark.parametrize('kinds', [KINDS, KINDS[1:2]])
def test_the_topics_of_the_scene_are_those_whose_messages_are_installed(monkeypatch, kinds):
    messages = SimpleNamespace(**{kind: type(kind, (), {}) for kind in kinds})
    monkeypatch.setattr(topics, 'import_module', lambda name: messages)
    found = topics._planning_scene_topics()
    assert {topic.type for topic in found} == {getattr(messages, kind) for kind in kinds}
    assert all(topic.name in topics.SCENE for topic in found)


def test_without_moveit_there_are_no_topics_of_the_scene(monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(topics, 'import_module', missing)
    assert topics._planning_scene_topics() == ()
