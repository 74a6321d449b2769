"""The default tip frame of a robot: the end of its longest chain, before a gripper."""

from __future__ import annotations

import re
from contextlib import suppress

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.tree import Joint, Tree
from ros_ik_pkg.ik.text import list_names

# A joint that opens a gripper, by its name or the name of the link that it moves.
JAW = re.compile(r'finger|jaw|knuckle|thumb|claw|gripper_?mover', re.IGNORECASE)
GRIPPER = re.compile(r'gripper', re.IGNORECASE)
WRIST = re.compile(r'wrist|roll|pitch|yaw|rot|twist|turn', re.IGNORECASE)
# Names of frames that mark the end of an arm, the most specific first.
TOOLS = tuple(re.compile(pattern, re.IGNORECASE) for pattern in (
    r'(^|_)tool0$', r'(^|_)tcp(_|$)', r'gripper_frame_link$', r'(^|_)(ee|tool|grasp|grip)([_a-z]*)?$', r'flange',
    r'(^|_)hand(_|$)'))


def default_tip(tree: Tree, base: str) -> tuple[str, tuple[str, ...]]:
    """Return the tip frame of the chain with the most movable joints from base, and warnings about the choice.

    Joints that open a gripper at the end of the chain do not count: the tip is then a tool frame fixed to the link
    that carries them, else that link. Raises ModelError if several chains are candidates.
    """
    ends = _longest(tree, base, _leaves(tree))
    carriers = {end: _carrier(tree, base, end) for end in ends}
    tips = list(dict.fromkeys(_tool_frame(tree, carrier) if carrier else end for end, carrier in carriers.items()))
    if len(tips) > 1:
        raise ModelError(f'the robot has several possible tips: {list_names(tips)}; choose one as tip frame')
    tip = tips[0]
    carrier = carriers[ends[0]]
    if carrier is None:
        return tip, ()
    below_carrier = tree.path(base, ends[0])[len(tree.path(base, carrier)) :]
    jaws = [joint.name for joint in below_carrier if joint.movable]
    others = [link for link in _leaves(tree) if link != tip]
    return tip, (f'no tip frame was chosen: the chain ends at {tip!r}, before the gripper (joint {list_names(jaws)}); '
                 f'other ends are {list_names(others)}',)


def _leaves(tree: Tree) -> list[str]:
    """Return the links without children."""
    parents = {joint.parent for joint in tree.joints}
    return [link for link in tree.links if link not in parents]


def _longest(tree: Tree, base: str, leaves: list[str]) -> list[str]:
    """Return the leaves with the most movable joints between base and them."""
    counts: dict[str, int] = {}
    for leaf in leaves:
        with suppress(ModelError):
            counts[leaf] = sum(joint.movable for joint in tree.path(base, leaf))
    most = max(counts.values())
    return [leaf for leaf, count in counts.items() if count == most]


def _carrier(tree: Tree, base: str, end: str) -> str | None:
    """Return the link that carries the gripper whose joints end the chain; None if none does, or nothing else moves."""
    path = tree.path(base, end)
    jaws = [k for k, joint in enumerate(path) if joint.movable]
    first = None
    while jaws and _opens_gripper(path[jaws[-1]]):
        first = jaws.pop()
    return path[first].parent if first is not None and jaws else None


def _opens_gripper(joint: Joint) -> bool:
    """Return whether a joint opens a gripper, judged by names."""
    if JAW.search(joint.name) or JAW.search(joint.child):
        return True
    return bool(GRIPPER.search(joint.name)) and not WRIST.search(joint.name)


def _tool_frame(tree: Tree, carrier: str) -> str:
    """Return the best tool frame among the links that are fixed to the carrier below it, else the carrier."""
    fixed, waiting = [carrier], [carrier]
    while waiting:
        link = waiting.pop()
        found = [joint.child for joint in tree.joints if joint.parent == link and joint.kind == 'fixed']
        fixed += found
        waiting += found
    for pattern in TOOLS:
        if found := [link for link in fixed if pattern.search(link)]:
            return found[0]
    return carrier
