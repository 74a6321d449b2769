"""The node compares methods on its targets, over DDS: after the solution, and only where asked and heard."""

from __future__ import annotations

import numpy as np
import pytest
from rclpy.parameter import Parameter
from ros_helpers import TIMEOUT, Client, allow_lark, connected, joint_state, pose_of, stamp_of

from ros_ik_pkg.compare import compare_methods
from ros_ik_pkg.compare.palette import COLOURS, TARGET, rgb
from ros_ik_pkg.ik import METHODS, SolveOptions, load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import values

pytestmark = [allow_lark, pytest.mark.newest]
ITERATIONS = 300


class ComparisonClient(Client):
    """A client that listens to comparisons, paths and traces."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        super().__init__(node, name)
        self.comparisons, self.paths, self.traces = [], [], []
        self._subscribe(topics.COMPARISON, self.comparisons.append)
        self._subscribe(topics.COMPARISON_PATHS, self.paths.append)
        self._subscribe(topics.TRACE, self.traces.append)

    def compare(self, pose):
        """Send a target and return its comparison and its paths."""
        self.solve(pose, TIMEOUT)
        stamp = stamp_of(pose)
        self.wait_for(lambda: stamp in map(stamp_of, self.comparisons), 'a comparison')
        self.wait_for(lambda: stamp in (stamp_of(paths.markers[-1]) for paths in self.paths), 'the paths')
        return self.comparisons[-1], self.paths[-1]

    def traces_of(self, pose, run: str) -> list:
        """Return the traces of one target and kind of run, in the order in which they came."""
        stamp = f'{pose.header.stamp.sec}.{pose.header.stamp.nanosec:09d}'
        labels = [about(trace) for trace in self.traces]
        return [trace for trace, said in zip(self.traces, labels) if (said['stamp'], said['run']) == (stamp, run)]


def about(trace) -> dict[str, str]:
    """Return what the label of a trace says, as the docs tell users to read it."""
    return dict(pair.split('=') for pair in trace.layout.dim[0].label.split()[1:])


@pytest.fixture(scope='module')
def arm():
    return load_arm('puma560')


@pytest.fixture(scope='module')
def target(arm) -> np.ndarray:
    return arm.forward(arm.home + 0.3)


@pytest.fixture(scope='module')
def client(tmp_path_factory, arm):
    log = tmp_path_factory.mktemp('comparison') / 'node.log'
    with connected(ComparisonClient, log, '-p', f'max_iterations:={ITERATIONS}', '-p', 'compare:=[all]') as client:
        home = joint_state(arm.joint_names, arm.home)
        client.settle(pose_of(arm.forward(arm.home)), lambda reply: reply.solved, home)
        yield client


def test_each_method_has_a_status_with_the_figures_of_the_comparison_without_ros(client, arm, target):
    comparison, _ = client.compare(pose_of(target))
    expected = compare_methods(arm, target, arm.home, METHODS, SolveOptions(max_iterations=ITERATIONS))
    assert len(comparison.status) == len(METHODS)
    for run, status in zip(expected, comparison.status):
        figures = values(status)
        assert status.name == f'ik_node: {run.method}' and figures['method'] == run.method
        assert figures['status'] == run.status.label
        assert int(figures['iterations']) == run.iterations
        # A quaternion on the way turns the target by a rounding.
        np.testing.assert_allclose(float(figures['position_error']), run.position_error, rtol=1e-3, atol=1e-12)
        assert float(figures['time']) > 0.0
        assert figures['joints_at_limits'].split() == list(run.joints_at_limits)


def test_the_comparison_has_stamp_frame_and_words_of_its_target(client, arm, target):
    pose = pose_of(target)
    comparison, paths = client.compare(pose)
    assert stamp_of(comparison) == stamp_of(pose)
    assert comparison.header.frame_id == arm.base_frame == paths.markers[-1].header.frame_id
    assert all(status.message.startswith(values(status)['method']) for status in comparison.status)


def test_the_trace_of_each_method_comes_with_its_name_and_the_stamp(client, target):
    pose = pose_of(target)
    comparison, _ = client.compare(pose)
    client.wait_for(lambda: len(client.traces_of(pose, 'comparison')) == len(METHODS), 'the traces')
    for trace, status in zip(client.traces_of(pose, 'comparison'), comparison.status):
        assert about(trace)['method'] == values(status)['method']
        assert trace.layout.dim[0].size == int(values(status)['iterations']) + 1


def test_the_node_s_own_trace_names_its_method(client, target):
    client.set_parameters({'method': 'sdls'})
    pose = pose_of(target)
    client.compare(pose)
    client.wait_for(lambda: client.traces_of(pose, 'solve'), 'the trace')
    assert [about(trace)['method'] for trace in client.traces_of(pose, 'solve')] == ['sdls']


def test_paths_are_lines_in_the_methods_colours_from_seed_to_target(client, arm, target):
    _, paths = client.compare(pose_of(target))
    lines = {marker.ns: marker for marker in paths.markers if marker.type == marker.LINE_STRIP and marker.points}
    assert set(lines) == set(METHODS)
    for method, line in lines.items():
        assert [round(255 * part) for part in (line.color.r, line.color.g, line.color.b)] == list(rgb(COLOURS[method]))
        start = line.points[0]
        np.testing.assert_allclose([start.x, start.y, start.z], arm.forward(arm.home)[:3, 3], atol=1e-9)
    assert len(lines['transpose'].points) <= 400


def test_the_target_is_red_and_each_method_has_a_legend(client, target):
    _, paths = client.compare(pose_of(target))
    by_name = {marker.ns: marker for marker in paths.markers}
    red = by_name['target']
    assert [round(255 * part) for part in (red.color.r, red.color.g, red.color.b)] == list(rgb(TARGET))
    assert paths.markers[0].action == red.DELETEALL
    assert all(by_name[f'{method} legend'].text.startswith(method) for method in METHODS)


def test_a_target_out_of_reach_is_compared_too(client):
    far = np.eye(4)
    far[:3, 3] = 5.0
    comparison, _ = client.compare(pose_of(far))
    assert {values(status)['status'] for status in comparison.status}.isdisjoint({'converged'})
    causes = ('from the target', 'singular', 'limit')
    assert all(any(cause in status.message for cause in causes) for status in comparison.status)


def test_methods_can_be_chosen_while_the_node_runs(client, target):
    client.set_parameters({'compare': ['dls', 'pinv']})
    comparison, _ = client.compare(pose_of(target))
    assert [values(status)['method'] for status in comparison.status] == ['dls', 'pinv']
    client.set_parameters({'compare': ['all']})


def test_nothing_is_compared_where_nothing_is_asked_for(client, target):
    client.set_parameters({'compare': ['dls']})
    client.compare(pose_of(target))
    before = len(client.comparisons)
    assert not client.set_one(Parameter('compare', Parameter.Type.STRING_ARRAY, []))
    refused = client.solve(pose_of(target), TIMEOUT)
    assert refused.solved
    client.set_parameters({'compare': ['all']})
    client.compare(pose_of(target))
    assert len(client.comparisons) == before + 1  # of the second target alone: topics keep their order


def test_a_refused_target_has_no_comparison(client, target):
    before = len(client.comparisons)
    nonsense = pose_of(target)
    nonsense.pose.position.x = float('nan')
    assert client.solve(nonsense, TIMEOUT).figures['outcome'] == 'refused'
    client.compare(pose_of(target))
    assert len(client.comparisons) == before + 1


def test_of_many_targets_at_once_the_last_is_compared_and_all_solutions_come(client, target):
    client.set_parameters({'max_iterations': 20000})
    pose = pose_of(target)
    replies = [client.solve(pose, TIMEOUT) for _ in range(20)]
    assert all(reply.solved for reply in replies)
    last = stamp_of(pose)
    client.wait_for(lambda: client.comparisons and stamp_of(client.comparisons[-1]) == last, 'the last comparison')
    client.set_parameters({'max_iterations': ITERATIONS})
