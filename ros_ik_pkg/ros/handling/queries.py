"""Queries of services: the joints for a pose, and poses for joints. They cause no commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from builtin_interfaces.msg import Time as Stamp

from ros_ik_pkg.ik import ArgumentError, Arm, NotCompiledError, World, solve
from ros_ik_pkg.ros.handling.result import REFUSED, Result
from ros_ik_pkg.ros.handling.target_handler import IDENTITY, TargetHandler, judge
from ros_ik_pkg.ros.input.pose import target_pose
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings

NEWEST = Stamp()
LONGEST = PARAMETERS['deadline'].maximum or 0.0  # s


class PoseQuery(NamedTuple):
    """The query which joints bring a link to a pose.

    joints: positions by name [rad, m] that count instead of the joint states, for the seed and for contact.
    link: the tool, the tip frame or a link that does not move relative to it; empty: the tool, or the tip frame.
    deadline: [s], 0 for that of the parameter.
    """

    service: str
    target: Target
    joints: Mapping[str, float]
    link: str
    avoid_collisions: bool
    deadline: float


class Queries:
    """Answers from the arm, the settings and the joint states of the handler."""

    def __init__(self, handler: TargetHandler) -> None:
        self._handler = handler
        self._derived: tuple[Settings, bool, float, Settings] | None = None  # with the options of a query
        self._room: tuple[World, Mapping[str, float], World] | None = None  # a world, joints, and the world with them

    def solve(self, query: PoseQuery) -> Result:
        """Return the result of a query."""
        try:
            result = self._solve(query)
        except RefusedError as error:
            result = self.refused(query.service, query.target, error)
        except ArgumentError as error:
            result = self.refused(query.service, query.target, RefusedError('argument', str(error)))
        except NotCompiledError as error:
            result = self.refused(query.service, query.target, RefusedError('compiling', str(error)))
        return result

    def refused(self, service: str, target: Target, error: RefusedError) -> Result:
        """Return the result of a query that is refused."""
        result = self._handler.without_solution(target, REFUSED, error.status, str(error))
        result.service = service
        return result

    def poses(
        self, frame: str, links: Sequence[str], joints: Mapping[str, float]
    ) -> tuple[list[np.ndarray], list[str], str]:
        """Return the names of links, their poses (4, 4) in a frame [m], empty for the base frame, and what is wrong.

        Unknown links are left out. If the frame is one of the robot, the same joints place it.
        """
        handler, arm = self._handler, self._handler.require_arm()
        known = [link for link in links if _has(arm, link)]
        unknown = [link for link in links if link not in known]
        frame = frame.removeprefix('/') or arm.base_frame
        if _has(arm, frame):
            base_from_frame = self._base_from(arm, frame, joints)
        else:
            base_from_frame = handler.base_from_frame(frame, NEWEST, arm)[0]
        frame_from_base = np.linalg.inv(base_from_frame)
        poses = [frame_from_base @ self._base_from(arm, link, joints) for link in known]
        return poses, known, f'no link {", ".join(map(repr, unknown))}' if unknown else ''

    def _base_from(self, arm: Arm, link: str, joints: Mapping[str, float]) -> np.ndarray:
        """Return the pose (4, 4) of a link, at the given joints and the joint states of all others."""
        try:
            names = arm.joints_to(link)
            missing = [name for name in names if name not in joints]
            found = self._handler.joint_states.positions(missing) if missing else {}
            return arm.base_from_frame(link, {**found, **joints})
        except ArgumentError as error:
            raise RefusedError('joint_states', str(error)) from error

    def _solve(self, query: PoseQuery) -> Result:
        handler, arm = self._handler, self._handler.require_arm()
        frame_from_target, notes = target_pose(query.target)
        base_from_frame, frame_notes = handler.base_from_frame(query.target.frame_id, NEWEST, arm)
        base_from_target = frame_from_target if base_from_frame is IDENTITY else base_from_frame @ frame_from_target
        if query.link and query.link != arm.moving_frame:
            base_from_target = base_from_target @ _link_from_tool(arm, query.link)
        seed = self._seed(arm, query.joints)
        settings = self._settings(query)
        world, room_notes = handler.surroundings.world(arm, settings)
        if query.avoid_collisions and world is None:
            room_notes += ('contact did not count: no shapes of the robot are known',)
        solution = solve(arm, base_from_target, seed, settings.options, world=self._world(arm, world, query.joints))
        outcome, status, reason = judge(solution, base_from_target, arm, settings.options)
        return Result(
            query.target, outcome, status, reason, settings.options.method, arm, solution,
            notes + frame_notes + room_notes, base_from_target, seed, service=query.service,
            demanded_rows=settings.options.demanded_rows(arm.n),
        )  # fmt: skip

    def _seed(self, arm: Arm, joints: Mapping[str, float]) -> np.ndarray:
        """Return the configuration (n,) to start from: the given joints, and for others that of a target."""
        if arm.joint_names and all(name in joints for name in arm.joint_names):
            return np.array([joints[name] for name in arm.joint_names])
        seed = self._handler.seed().copy()
        for k, name in enumerate(arm.joint_names):
            seed[k] = joints.get(name, seed[k])
        return seed

    def _settings(self, query: PoseQuery) -> Settings:
        """Return the settings with the options of the query; the same object while nothing changes."""
        settings = self._handler.settings
        wanted = query.avoid_collisions, min(query.deadline, LONGEST)
        if self._derived is None or self._derived[0] is not settings or self._derived[1:3] != wanted:
            options = replace(
                settings.options, avoid_collisions=wanted[0], deadline=wanted[1] or settings.options.deadline
            )
            self._derived = settings, *wanted, replace(settings, options=options)
        return self._derived[3]

    def _world(self, arm: Arm, world: World | None, joints: Mapping[str, float]) -> World | None:
        """Return the world with the given joints outside the chain; the same object while nothing changes."""
        if world is None:
            return None
        given = {name: joints[name] for name in arm.contacts.outside if name in joints}
        if not given:
            return world
        if self._room is None or self._room[0] is not world or self._room[1] != given:
            self._room = world, given, World(world.floor, world.obstacles, {**world.positions, **given})
        return self._room[2]


def _has(arm: Arm, link: str) -> bool:
    return link in arm.frame_names or (link != '' and link == arm.tool_frame)


def _link_from_tool(arm: Arm, link: str) -> np.ndarray:
    """Return the pose (4, 4) of the tool in the frame of a link; refuse one that does not move with the tip."""
    try:
        link_from_tool = arm.frame_from_tool(link)
    except ArgumentError as error:
        raise RefusedError('link', f'ik_link_name: {error}') from error
    if link_from_tool is None:
        raise RefusedError('link', f'ik_link_name: {link!r} moves relative to the tip frame {arm.tip_frame!r}')
    return link_from_tool
