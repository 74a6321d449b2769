"""The layouts for RViz, Foxglove and PlotJuggler can be read and name topics that the node has."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import yaml

from ros_ik_pkg.methods import TABLE
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.output.comparison_messages import FIGURES

CONFIG = Path(__file__).resolve().parents[2] / 'config'
TOPICS = {re.sub('^~', '/ik_node', topic.name) for topic in topics.TOPICS}
SHARED = {f'/{topic.name}' for topic in topics.TOPICS if topic.name[0] not in '~/'}


def topics_in(text: str) -> set[str]:
    """Return the topics of the node that a text names."""
    return set(re.findall(r'/ik_node/\w+|/target_pose|/robot_description|/diagnostics', text))


def test_the_layouts_name_topics_of_the_node_alone():
    for path in CONFIG.glob('*/ros_ik_pkg.*'):
        named = topics_in(path.read_text())
        assert named and named <= TOPICS | SHARED, path


def test_rviz_shows_the_ways_of_the_methods():
    displays = yaml.safe_load((CONFIG / 'rviz' / 'ros_ik_pkg.rviz').read_text())['Visualization Manager']['Displays']
    shown = {display['Class']: display['Topic']['Value'] for display in displays if 'Topic' in display}
    assert shown['rviz_default_plugins/MarkerArray'] == '/ik_node/comparison_paths'


def test_every_panel_of_the_foxglove_layout_is_configured():
    document = json.loads((CONFIG / 'foxglove' / 'ros_ik_pkg.json').read_text())

    def leaves(node):
        return {node} if isinstance(node, str) else leaves(node['first']) | leaves(node['second'])

    assert leaves(document['layout']) == set(document['configById'])


def test_plotjuggler_draws_figures_that_the_comparison_has():
    tree = ElementTree.parse(CONFIG / 'plotjuggler' / 'ros_ik_pkg.xml')
    assert {curve.get('name').rpartition('/')[2] for curve in tree.iter('curve')} <= set(FIGURES)


def test_plotjuggler_draws_every_method_in_its_colour():
    for plot in ElementTree.parse(CONFIG / 'plotjuggler' / 'ros_ik_pkg.xml').iter('plot'):
        curves = {curve.get('name').split(': ')[1].split('/')[0]: curve.get('color') for curve in plot}
        assert curves == {method.name: method.look.colour for method in TABLE}
