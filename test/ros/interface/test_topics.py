"""The table of topics in the docs is the one in the code."""

from __future__ import annotations

from ros_ik_pkg.ros.interface.topics import TOPICS, Topic


def row(topic: Topic) -> str:
    """Write a topic as the docs do."""
    kind = f'{topic.type.__module__.split(".")[0]}/{topic.type.__name__}'
    reliability = 'best effort' if topic.best_effort else 'reliable'
    qos = f'{reliability}, {"latched, " if topic.latched else ""}depth {topic.depth}'
    return f'| `{topic.name}` | {kind} | {topic.direction} | {qos} | {topic.text} |'


def test_the_documented_topics_are_those_of_the_table(root):
    lines = (root / 'docs' / 'topics.md').read_text().splitlines()
    start = lines.index('|---|---|---|---|---|') + 1
    assert lines[start : start + len(TOPICS) + 1] == [*map(row, TOPICS), '']
