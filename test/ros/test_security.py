"""Who may talk to the node and to the panel: the SROS 2 policy, what the page may ask for, where it is served."""

from __future__ import annotations

import re
import socket
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest
from ros_helpers import ROOT, TIMEOUT, allow_lark, node_process, wait_until_ready

from ros_ik_pkg.panel.exposure import is_loopback, warning_about
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.tools.processes import ros_node

pytestmark = [allow_lark, pytest.mark.newest]

POLICY = ElementTree.parse(ROOT / 'config' / 'sros2' / 'ik_node.policy.xml').getroot()
OWN = '/ik_node'
TF = {'/tf', '/tf_static'}  # of the listener beside the node, where tf2_ros is installed


def allowed(enclave: str, kind: str, verb: str) -> set[str]:
    """Return the full names that an enclave may use, resolved as SROS 2 does."""
    (profile,) = POLICY.findall(f'enclaves/enclave[@path="{enclave}"]/profiles/profile')
    names = [entry.text for group in profile.findall(f'{kind}s[@{verb}="ALLOW"]') for entry in group.findall(kind)]
    assert len(names) == len(set(names))
    own = profile.get('ns') + profile.get('node')
    return {name if name.startswith('/') else name.replace('~', own) if '~' in name else f'/{name}' for name in names}


def full_names(direction: str) -> set[str]:
    """Return the full names of the topics of the table."""
    names = (topic.name.replace('~', OWN) for topic in topics.TOPICS if topic.direction == direction)
    return {name if name.startswith('/') else f'/{name}' for name in names}


def test_the_policy_has_the_form_that_sros2_reads():
    assert (POLICY.tag, POLICY.get('version')) == ('policy', '0.2.0')
    assert [enclave.get('path') for enclave in POLICY.iter('enclave')] == ['/ik_node', '/ik_client']
    rules = [list(group.attrib.items()) for kind in ('topics', 'services') for group in POLICY.iter(kind)]
    assert all(verb in ('publish', 'subscribe', 'reply') and rule == 'ALLOW' for ((verb, rule),) in rules)


def test_the_policy_names_the_topics_of_the_table_and_those_that_every_node_has():
    assert allowed(OWN, 'topic', 'subscribe') == full_names('in') | TF
    assert allowed(OWN, 'topic', 'publish') == full_names('out') | {'/parameter_events', '/rosout'}


def test_the_policy_is_what_the_running_node_uses(tmp_path):
    log = tmp_path / 'log'
    with node_process(log) as process, ros_node('watcher') as watcher:
        wait_until_ready(process, log)
        assert names_seen(watcher, 'publisher', '/diagnostics') == allowed(OWN, 'topic', 'publish')
        assert names_seen(watcher, 'subscriber', '/second_target_pose') == allowed(OWN, 'topic', 'subscribe') - TF
        assert names_seen(watcher, 'service', f'{OWN}/set_parameters_atomically') == allowed(OWN, 'service', 'reply')


def names_seen(watcher, verb: str, last: str) -> set[str]:
    """Return what DDS tells of the node, once it tells all of it: in order, so the one that is made last comes last."""
    deadline, seen = time.monotonic() + TIMEOUT, set()
    while last not in seen:
        assert time.monotonic() < deadline, seen
        time.sleep(0.02)
        if ('ik_node', '/') in watcher.get_node_names_and_namespaces():
            seen = {name for name, _ in getattr(watcher, f'get_{verb}_names_and_types_by_node')('ik_node', '/')}
    return seen


def test_the_client_of_the_policy_may_send_targets_and_read_and_set_nothing():
    assert allowed('/ik_client', 'topic', 'publish') - {'/parameter_events', '/rosout'} == {'/target_pose'}
    assert allowed('/ik_client', 'topic', 'subscribe') <= full_names('out')
    assert allowed('/ik_client', 'service', 'request') == set()


def test_the_commands_of_the_document_name_what_there_is():
    text = (ROOT / 'docs' / 'security.md').read_text()
    enclaves = {enclave.get('path') for enclave in POLICY.iter('enclave')}
    for verb in ('create_enclave', 'create_permission'):
        assert set(re.findall(rf'ros2 security {verb} \S+ (\S+)', text)) == enclaves
    assert '/config/sros2/ik_node.policy.xml' in text
    assert re.findall(r'--enclave (\S+)', text) == ['/ik_node']


@pytest.mark.parametrize('host', ['127.0.0.1', '127.1.2.3', '::1', 'localhost'])
def test_an_address_of_this_machine_alone_is_no_matter(host):
    assert is_loopback(host) and warning_about(host) == ''


@pytest.mark.parametrize('host', ['0.0.0.0', '::', '', '192.168.1.5', 'robot.local', 'localhost.example.org'])
def test_an_address_that_others_reach_is_warned_about(host):
    assert f'--host {host} serves the page to other machines' in warning_about(host)
    assert 'no password' in warning_about(host)


@pytest.fixture(scope='module')
def server():
    """What the panel serves by, at its default address."""
    viser = pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
    from ros_ik_pkg.panel.panel_node import arguments

    server = viser.ViserServer(host=arguments().parse_args([]).host, port=18080, verbose=False)
    yield server
    server.stop()


def ask(port: int, path: str) -> bytes:
    """Send a request as it is, which no browser and no library would."""
    with socket.create_connection(('127.0.0.1', port), TIMEOUT) as connection:
        connection.sendall(f'GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n'.encode())
        connection.settimeout(TIMEOUT)
        return b''.join(iter(lambda: connection.recv(65536), b''))


def test_the_panel_listens_on_loopback_alone_and_serves_no_file_by_path(server):
    listening = [line.split()[1] for line in Path('/proc/net/tcp').read_text().splitlines() if line.split()[3] == '0A']
    port = server.get_port()
    assert f'0100007F:{port:04X}' in listening and f'00000000:{port:04X}' not in listening
    assert b' 200 ' in ask(port, '/').splitlines()[0]
    for path in ('/../../../../../../../etc/passwd', '/%2e%2e/%2e%2e/%2e%2e/etc/passwd', '//etc/passwd', '/etc/passwd',
                 '/..%5c..%5cetc%5cpasswd', '/./.././etc/passwd'):  # fmt: skip
        reply = ask(port, path)
        assert b' 404 ' in reply.splitlines()[0] and b'root:' not in reply, path


def test_a_page_can_neither_name_a_path_nor_ask_for_a_public_address(server, tmp_path):
    from ros_ik_pkg.ik import IkError
    from ros_ik_pkg.panel.exposure import stay_private
    from ros_ik_pkg.panel.panel import Panel

    path = tmp_path / 'other.yaml'
    path.write_text((ROOT / 'config' / 'robots' / 'panda.yaml').read_text())
    stay_private(server)
    assert server.request_share_url() is None
    with ros_node('panel_test') as node:
        panel = Panel(server, node, 'ik_node')
        for ask_for in (panel.choose_robot, lambda text: panel.upload_urdf(text, text)):
            with pytest.raises(IkError):
                ask_for(str(path))
            assert panel._arm.name == 'puma560' and panel._robot['robot'] == 'puma560'
        panel.choose_robot('ur5')
        assert panel._arm.name == 'ur5'
