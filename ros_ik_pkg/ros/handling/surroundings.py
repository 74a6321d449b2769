"""The world of the arm: floor, obstacles, and the positions of the joints outside its chain."""

from __future__ import annotations

from collections import deque
from operator import is_
from threading import Lock
from typing import Any

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from ros_ik_pkg.ik import Arm, World
from ros_ik_pkg.ik.contacts.obstacles_file import read_obstacles
from ros_ik_pkg.ik.text import list_names
from ros_ik_pkg.ik.world import Obstacle
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.obstacle_markers import ObstacleMarkers
from ros_ik_pkg.ros.input.planning_scene import Place, SceneObjects
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.interface.parameters import NO_GROUND, Settings

MOVED = 1e-4  # rad or m; joints outside the chain that move by less have not moved
MOST_EARLY = 100  # messages that wait for the robot, the newest ones


class Surroundings:
    """Makes the World for each target; the same object while nothing changes. Safe to use from several threads."""

    def __init__(self, joint_states: JointStates) -> None:
        self.markers = ObstacleMarkers()
        self.scene = SceneObjects()
        self._joint_states = joint_states
        self._files: dict[str, tuple[Obstacle, ...]] = {'': ()}
        self._world: World | None = None
        self._positions = np.empty(0)
        self._said: tuple[str, ...] = ()
        self._early: deque[Any] = deque(maxlen=MOST_EARLY)
        self._base = ''  # frame that the obstacles are in; empty before the first robot
        self._lock = Lock()

    def read(self, settings: Settings) -> None:
        """Read the obstacles_file of new settings, so that errors show before they apply; raises ModelError."""
        source = settings.obstacles_file
        self._files[source] = read_obstacles(source) if source else ()

    def take(self, message: Any, arm: Arm | None, place: Place) -> list[str]:
        """Take a MarkerArray or one of MoveIt's messages; return why some of it is left aside.

        What comes before the robot waits for it, because it cannot be placed yet.
        """
        with self._lock:
            if arm is None:
                self._early.append(message)
                return []
            return self._take(message, arm, place)

    def take_over(self, arm: Arm, place: Place) -> list[str]:
        """Leave obstacles where they are in the base frame of another arm, and take what came before there was one;
        return why some are left aside."""
        reasons = []
        with self._lock:
            if self._base not in ('', arm.base_frame):
                try:
                    self._move(place(Header(frame_id=self._base)))
                except RefusedError as error:
                    lost = len(self.markers.current()) + len(self.scene.current())
                    self.markers, self.scene = ObstacleMarkers(), SceneObjects()
                    if lost:
                        where = f'{self._base!r}, the base frame of another robot'
                        reasons.append(f'all that were given in {where}: {error}')
            self._base = arm.base_frame
            while self._early:
                reasons += self._take(self._early.popleft(), arm, place)
        return reasons

    def _take(self, message: Any, arm: Arm, place: Place) -> list[str]:
        links = [link for link in arm.tree.links if link != arm.base_frame]
        taken_by = self.markers if isinstance(message, MarkerArray) else self.scene
        return taken_by.take(message, place, links, (arm.tip_frame, arm.moving_frame))

    def _move(self, base_from_old: np.ndarray) -> None:
        self.markers.move(base_from_old)
        self.scene.move(base_from_old)

    def world(self, arm: Arm, settings: Settings) -> tuple[World | None, tuple[str, ...]]:
        """Return the current World, or None if contact does not count, and notes that are new."""
        world, missing = self._look(arm, settings)
        notes = (f'no position of joint {list_names(missing)} yet: taken at rest for contact',) if missing else ()
        notes, self._said = () if missing == self._said else notes, missing
        return world, notes

    def newest(self, arm: Arm, settings: Settings) -> World | None:
        """Return the current World, or None if contact does not count."""
        return self._look(arm, settings)[0]

    def _look(self, arm: Arm, settings: Settings) -> tuple[World | None, tuple[str, ...]]:
        """Return the current World, and names of joints outside the chain whose positions are not known."""
        if not settings.options.avoid_collisions or not arm.shaped:
            return None, ()
        outside = arm.contacts.outside
        found = self._joint_states.positions(outside) if outside else {}
        missing = tuple(name for name in outside if name not in found)
        floor = None if settings.ground <= NO_GROUND else settings.ground
        file = self._files.get(settings.obstacles_file, ())
        positions = np.array(list(found.values()))
        with self._lock:
            obstacles = (*file, *self.markers.current(), *self.scene.current())
            world = self._world
            same = (
                world is not None and world.floor == floor and world.positions.keys() == found.keys()
                and len(world.obstacles) == len(obstacles) and all(map(is_, world.obstacles, obstacles))
                and np.all(np.abs(positions - self._positions) < MOVED)
            )  # fmt: skip
            if not same:
                self._world, self._positions = World(floor, obstacles, found), positions
            return self._world, missing
