"""What the panel sends and shows, without a browser: a real page server, and an IK node that is made up."""

from __future__ import annotations

import types
from collections.abc import Callable

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from ros_helpers import ROOT, allow_lark
from sensor_msgs.msg import JointState

from ros_ik_pkg.ik import METHODS, IkError
from ros_ik_pkg.panel.answers import Answers
from ros_ik_pkg.ros.interface.servo_settings import SERVO_OPTIONS
from ros_ik_pkg.ros.output.statuses import key_values
from ros_ik_pkg.tools.processes import ros_node

viser = pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
pytestmark = [allow_lark, pytest.mark.once]

NODE = {
    'robot': 'puma560', 'robot_description': '', 'base_frame': '', 'tip_frame': '', 'tip_frames': [],
    'limits': 'soft', 'joint_limits': '', 'held_joints': [], 'xacro_args': [], 'srdf': '', 'tool': [],
    'method': 'adaptive_dls',
    'max_iterations': 700, 'step_size': 1.0, 'dls.damping': 2.5, 'adaptive_dls.damping': 1e-3,
    'adaptive_dls.gain': 0.2, 'sdls.max_step': 0.7, 'position_tolerance': 3e-5, 'orientation_tolerance': 1e-3,
    'compare': [], 'path.tool_speed': 0.0, 'path.max_reconfigurations': 0, 'velocity_scale': 1.0,
    **{option.ros_name: option.default for option in SERVO_OPTIONS},
}  # fmt: skip


class MadeUpNode:
    """Stands for the link to the node: answers at once, and notes what it was sent."""

    def __init__(self, values=NODE) -> None:
        self.name, self.alive, self.answers = '/ik_node', True, Answers()
        self.values = dict(values)
        self.sent: list[dict] = []
        self.published: list = []
        self.heard: dict[str, Callable] = {}
        self.targets: list[np.ndarray] = []
        self.refusal: Callable[[dict], str] = lambda _: ''

    def get_parameters(self, names, done) -> None:
        done({name: self.values[name] for name in names})

    def set_parameters(self, values, done) -> None:
        self.sent.append(dict(values))
        refusal = self.refusal(values)
        if not refusal:
            self.values |= values
        done(refusal)

    def now(self) -> Time:
        return Time(sec=7)

    def publisher(self, topic):
        return types.SimpleNamespace(publish=self.published.append)

    def listen(self, topic, callback, queue=0):
        self.heard[topic.name] = callback

    def leave(self, subscription) -> None:
        pass

    def call(self, service, done) -> None:
        done(f'{service} is called')

    def publish_joints(self, arm, positions) -> None:
        self.joints = positions

    def send_target(self, arm, target) -> None:
        self.targets.append(target)
        self.answers.expect(str(len(self.targets)) + '.000000000')

    def say(self, outcome: str, status: str = '', q=None, message: str = 'so it is') -> None:
        """Answer the newest target."""
        seconds = len(self.targets)
        if q is not None:
            solution = JointState(name=[f'joint{k + 1}' for k in range(len(q))], position=list(q))
            solution.header.stamp.sec = seconds
            self.answers.take_solution(solution)
        figures = {'outcome': outcome, 'status': status, 'method': 'dls', 'iterations': 8, 'attempts': 1,
                   'solve_time': 1e-4, 'published': 'nothing' if q is None else 'solution'}  # fmt: skip
        result = DiagnosticArray(status=[DiagnosticStatus(message=message, values=key_values(figures))])
        result.header.stamp.sec = seconds
        self.answers.take_result(result)

    def compare(self, *methods: str) -> None:
        """Send a comparison in which all methods converge."""
        statuses = [
            DiagnosticStatus(values=key_values({
                'method': method, 'status': 'converged', 'iterations': 4, 'position_error': 1e-9,
                'orientation_error': 1e-9, 'time': 1e-5, 'sigma_min': 0.1, 'joints_at_limits': '',
            })) for method in methods
        ]  # fmt: skip
        comparison = DiagnosticArray(status=statuses)
        comparison.header.stamp.sec = len(self.targets)
        self.answers.take_comparison(comparison)


@pytest.fixture(scope='module')
def server():
    server = viser.ViserServer(host='127.0.0.1', port=18090, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope='module')
def ros():
    with ros_node('panel_test') as node:
        yield node


@pytest.fixture
def clock(monkeypatch):
    """The panel's clock, which stands still until a test moves it."""
    from ros_ik_pkg.panel import asking, node_sync, panel

    clock = types.SimpleNamespace(now=100.0)
    for module in (asking, node_sync, panel):
        monkeypatch.setattr(module, 'time', types.SimpleNamespace(monotonic=lambda: clock.now))
    return clock


@pytest.fixture
def panel(server, ros, clock, monkeypatch):
    """A panel on a node that is made up, not yet ticked."""
    server.scene.reset()
    server.gui.reset()
    return panel_on(MadeUpNode(), server, ros, monkeypatch)


def panel_on(made_up, server, ros, monkeypatch):
    """Return a panel on a node that is made up."""
    from ros_ik_pkg.panel import panel

    monkeypatch.setattr(panel, 'NodeLink', lambda *_: made_up)
    return panel.Panel(server, ros, 'ik_node')


def ticks(panel, count: int = 4) -> None:
    for _ in range(count):
        panel.tick()


def status(panel) -> str:
    return panel._readings._status.content


def table(panel) -> str:
    return panel._readings._table.content


def test_an_event_that_fails_is_shown_and_the_next_ones_go_on(panel):
    ticks(panel)
    for call in (lambda: panel.choose_preset('nonsense'), lambda: {}['KeyError: no such thing'],
                 lambda: panel._controls.parameters._handles['position_tolerance'].no_such_attribute):  # fmt: skip
        panel._events.put(call)
    panel._events.put(lambda: panel.choose_preset('Unreachable'))
    panel.tick()
    assert 'AttributeError' in status(panel)
    np.testing.assert_allclose(np.linalg.norm(panel._problem.target[:3, 3]), 1.3 * 0.873, rtol=1e-2)


@pytest.mark.parametrize(
    ('ask', 'told'),
    [
        (lambda panel: panel.choose_preset('nonsense'), 'no preset &#x27;nonsense&#x27;; expected one of Lecture'),
        (lambda panel: panel.choose_robot('/etc/passwd'), 'no robot &#x27;/etc/passwd&#x27;; expected one of puma560'),
        (lambda panel: panel._controls.parameters._change('method', 'nonsense'), 'expected one of transpose'),
        (lambda panel: panel._controls.parameters._change('position_tolerance', float('abc')), 'abc'),
        (lambda panel: panel._controls.parameters._change('max_iterations', -1), 'max_iterations = -1'),
        (lambda panel: panel._controls._seed._move(0, 1e9), 'joint1 = 1e+09 is not allowed: expected -160 to 160'),
        (lambda panel: panel._controls._seed._move(0, float('nan')), 'joint1 = nan'),
        (lambda panel: panel.set_target(np.full((4, 4), np.nan)), 'not finite'),
        (lambda panel: panel.upload_urdf('/etc/passwd', 'my.urdf'), 'the file &#x27;my.urdf&#x27; is'),
        (lambda panel: panel.upload_urdf('<robot', 'my.urdf'), 'the file &#x27;my.urdf&#x27;: '),
    ],
)  # fmt: skip
def test_what_a_page_must_not_send_is_told_and_changes_nothing(panel, ask, told):
    ticks(panel)
    sent, problem = list(panel._link.sent), panel._problem
    panel._events.put(lambda: ask(panel))
    panel.tick()
    assert told in status(panel)
    assert panel._link.sent == sent and panel._problem is problem


def test_a_control_that_was_given_nonsense_shows_what_counts_again(panel):
    ticks(panel)
    handle = panel._controls.parameters._handles['position_tolerance']
    handle.value = 'abc'
    panel._events.put(lambda: panel._controls.parameters._change('position_tolerance', float('abc')))
    panel.tick()
    assert float(handle.value) == 3e-5


def test_only_what_was_changed_on_the_page_is_sent(panel):
    ticks(panel)
    assert panel._link.sent == [{'compare': list(METHODS)}]
    panel.set_parameter('max_iterations', 50)
    ticks(panel)
    assert panel._link.sent[1:] == [{'max_iterations': 50}]


def test_parameters_of_the_node_are_shown_as_they_are(panel):
    ticks(panel)
    handles = panel._controls.parameters._handles
    shown = {name: handle.value for name, handle in handles.items()}
    assert float(shown['position_tolerance']) == 3e-5 and float(shown['orientation_tolerance']) == 1e-3
    assert shown['dls.damping'] == 2.5 <= handles['dls.damping'].max
    assert shown['max_iterations'] == 700


def test_a_node_that_compares_already_is_left_as_it_is(panel):
    panel._link.values['compare'] = ['dls', 'sdls']
    ticks(panel)
    assert panel._link.sent == [{}]
    assert list(panel._controls.parameters.compared) == ['dls', 'sdls']


def test_a_node_that_was_started_again_gets_what_was_changed_and_keeps_the_rest(panel):
    ticks(panel)
    panel.set_parameter('method', 'sdls')
    panel._link.alive = False
    ticks(panel)
    panel._link.values, panel._link.alive = {**NODE, 'max_iterations': 30}, True
    panel._link.sent.clear()
    ticks(panel)
    assert panel._link.sent == [{'compare': list(METHODS), 'method': 'sdls'}]
    assert panel._controls.parameters._handles['max_iterations'].value == 30


def test_what_the_node_refuses_is_told_and_taken_back(panel):
    ticks(panel)
    panel._link.refusal = lambda values: 'not on a Tuesday' if 'max_iterations' in values else ''
    panel._events.put(lambda: panel.set_parameter('max_iterations', 50))
    panel.tick()
    assert 'the node refused: not on a Tuesday' in status(panel)
    assert panel._controls.parameters._handles['max_iterations'].value == 700
    assert 'max_iterations' not in panel._sync.parameters.changed


def test_a_robot_that_the_node_refuses_is_left_again(panel):
    ticks(panel)
    panel._link.refusal = lambda values: 'no such robot here' if values.get('robot') == 'ur5' else ''
    panel._events.put(lambda: panel.choose_robot('ur5'))
    ticks(panel)
    assert panel._arm.name == 'puma560' and panel._controls._robot.value == 'puma560' and panel._sync.ready


@pytest.mark.parametrize('robot', ['../elsewhere/arm.urdf', ''])
def test_a_robot_that_cannot_be_read_here_is_told_and_another_can_be_chosen(panel, robot):
    panel._link.values['robot'] = robot
    ticks(panel)
    assert 'cannot show the robot of the node' in status(panel) and 'Choose another one' in status(panel)
    assert not panel._link.targets
    panel._link.alive = False
    ticks(panel)
    panel._link.alive = True
    ticks(panel)
    assert not panel._link.targets, 'sent to an arm that the page does not know'
    panel._events.put(lambda: panel.choose_robot('puma560'))
    ticks(panel)
    assert panel._link.values['robot'] == 'puma560' and panel._link.targets


def test_a_refused_target_is_told_and_not_sent_again(panel, clock):
    ticks(panel)
    panel._link.say('refused', 'position', message='target position is beyond 1e+06 m')
    for _ in range(5):
        clock.now += 2.0
        ticks(panel)
    assert len(panel._link.targets) == 1
    assert 'target position is beyond' in status(panel) and 'data-method' not in table(panel)


@pytest.mark.parametrize('cause', ['joint_states', 'no_robot'])
def test_a_target_that_came_too_early_is_sent_again(panel, clock, cause):
    ticks(panel)
    panel._link.say('refused', cause)
    clock.now += 2.0
    ticks(panel)
    assert len(panel._link.targets) == 2


def test_with_all_methods_off_the_page_lives_on(panel):
    ticks(panel)
    panel._link.say('solved', q=np.zeros(6))
    panel._link.compare(*METHODS)
    ticks(panel)
    assert 'data-method="sdls"' in table(panel)
    for box in panel._controls.parameters._compared.values():
        box.value = False
    panel._events.put(lambda: panel.set_parameter('compare', ()))
    ticks(panel)
    assert 'Choose methods to compare.' in status(panel) and 'data-method' not in table(panel)
    sent = len(panel._link.targets)
    panel.choose_preset('Random')
    panel._link.say('solved', q=np.full(6, 0.5))
    ticks(panel)
    panel._link.say('solved', q=np.full(6, 0.7))
    ticks(panel)
    assert len(panel._link.targets) > sent
    assert 'solved by dls in 8 iterations' in status(panel)
    np.testing.assert_allclose(panel._scene._goal, 0.7)


def test_after_a_failure_no_arm_and_no_tip_are_left_of_the_target_before(panel):
    ticks(panel)
    panel._link.say('solved', q=np.zeros(6))
    ticks(panel)
    assert panel._scene._body.visible and '0.432' in panel._controls._tip.content
    panel._link.say('failed', 'unreachable')
    ticks(panel)
    assert not panel._scene._body.visible
    assert '0.432' not in panel._controls._tip.content and 'no solution' in panel._controls._tip.content


def test_what_is_typed_right_after_a_preset_counts(panel, monkeypatch):
    calls = {}
    monkeypatch.setattr(type(panel._controls), 'on', lambda self, handle, call: calls.setdefault(id(handle), call))
    with panel._server.gui.add_folder('again'):
        panel._controls._add_target()
    ticks(panel)
    panel.choose_preset('Lecture notes')
    typed = calls[id(panel._controls._position)]
    panel.tick()  # writes the preset to the field, over what was typed in the meantime
    panel._events.put(lambda: typed((0.35, 0.3, 0.6)))
    panel.tick()
    np.testing.assert_allclose(panel._problem.target[:3, 3], [0.35, 0.3, 0.6])
    np.testing.assert_allclose(panel._controls._position.value, [0.35, 0.3, 0.6])


def test_the_title_counts_the_methods(panel, monkeypatch):
    labels = []
    monkeypatch.setattr(panel._readings._gui, 'set_panel_label', labels.append)
    panel._link.values['compare'] = ['dls']
    ticks(panel)
    panel._link.say('solved', q=np.zeros(6))
    ticks(panel)
    assert labels[-1] == 'One method, one target'


def test_what_is_left_of_a_node_that_is_gone_is_faint(panel):
    ticks(panel)
    panel._link.say('solved', q=np.zeros(6))
    panel._link.compare(*METHODS)
    ticks(panel)
    assert 'class="ik old"' not in table(panel)
    panel._link.alive = False
    ticks(panel)
    assert 'class="ik old"' in table(panel) and 'no IK node' in status(panel)
    panel._link.alive = True
    ticks(panel)
    assert 'class="ik old"' not in table(panel)


URDF = """<robot name="stick"><link name="base"/><link name="stick"/>
  <joint name="hinge" type="continuous"><parent link="base"/><child link="stick"/><axis xyz="0 0 1"/></joint>
</robot>"""


def test_a_robot_that_was_opened_stays_among_those_that_can_be_chosen(panel):
    ticks(panel)
    panel.upload_urdf(URDF, 'stick.urdf')
    assert panel._arm.name == 'stick'
    panel.choose_robot('panda')
    assert 'stick' in panel._controls._robot.options
    panel.choose_robot('stick')
    ticks(panel)
    assert panel._arm.name == 'stick' and panel._link.values['robot_description'] == URDF
    assert panel._controls._robot.value == 'stick'


def test_the_robot_of_the_node_stays_among_those_that_can_be_chosen(panel, tmp_path):
    path = tmp_path / 'arm.yaml'
    path.write_text((ROOT / 'config' / 'robots' / 'ur5.yaml').read_text())
    panel._link.values['robot'] = str(path)
    ticks(panel)
    panel.choose_robot('panda')
    own = panel._controls._robot.options[-1]
    panel.choose_robot(own)
    ticks(panel)
    assert panel._link.values['robot'] == str(path)


def test_two_robots_of_one_name_can_both_be_chosen():
    from ros_ik_pkg.panel.robots import Robots, parameters_of

    robots = Robots()
    assert robots.add(parameters_of(robot_description='<robot 1>'), 'panda') == 'panda (2)'
    assert robots.add(parameters_of(robot_description='<robot 2>'), 'panda') == 'panda (3)'
    assert robots.add(parameters_of(robot_description='<robot 1>'), 'panda') == 'panda (2)'
    assert robots.parameters('panda') == parameters_of('panda')
    with pytest.raises(IkError, match='no robot'):
        robots.parameters('nosuch')


def test_messages_that_make_no_sense_do_not_end_the_panel(ros):
    from std_msgs.msg import Float64MultiArray

    from ros_ik_pkg.panel.events import Events
    from ros_ik_pkg.panel.node_link import NodeLink

    told = []
    events = Events(ros.get_logger(), told.append)
    link = NodeLink(ros, 'ik_node', events.put)
    link._queued(link.answers.take_trace)(Float64MultiArray())
    events.run()
    assert told and told[0].startswith('IndexError')


def test_the_cameras_follow_a_robot_of_another_size_and_a_target_far_away_alone(server):
    from ros_ik_pkg.panel.drawing.camera import Camera

    camera = Camera(server)
    camera.begin(1.0, 0.0)
    camera.follow(np.array([0.4, 0.0, 0.4]))
    first = server.initial_camera.position
    camera.follow(np.array([0.5, 0.1, 0.3]))
    assert server.initial_camera.position is first
    camera.follow(np.array([2.0, 0.0, 0.0]))
    assert np.linalg.norm(server.initial_camera.position) > 1.5 * np.linalg.norm(first)
    camera.begin(0.5, 0.0)
    camera.follow(np.array([0.2, 0.0, 0.2]))
    np.testing.assert_allclose(server.initial_camera.position, 0.5 * first)


def test_a_joint_that_the_node_holds_is_no_joint_of_the_page(panel):
    panel._link.values |= {'robot': 'ur5', 'held_joints': ['wrist_3_joint:=0.5']}
    ticks(panel)
    assert panel._arm.n == 5 and 'wrist_3_joint' not in panel._arm.joint_names
    assert len(panel._controls._seed._sliders) == 5
    panel.choose_robot('puma560')
    assert list(panel._link.values['held_joints']) == []


def test_a_node_that_does_not_answer_is_asked_again_ever_more_rarely(panel, clock):
    ticks(panel)
    sent = []
    for _ in range(16):
        clock.now += 0.5
        ticks(panel, 1)
        sent.append(len(panel._link.targets))
    assert sent.count(1) >= 2 and 3 <= sent[-1] <= 4  # after 1, 2 and 4 seconds
    panel._link.say('solved', q=np.zeros(6))
    ticks(panel)
    assert len(panel._link.targets) == sent[-1]
