"""The world of the arm: floor, obstacles, and the positions of the joints outside its chain."""

from __future__ import annotations

from operator import is_

import numpy as np

from ros_ik_pkg.ik import Arm, World
from ros_ik_pkg.ik.contacts.obstacles_file import read_obstacles
from ros_ik_pkg.ik.text import list_names
from ros_ik_pkg.ik.world import Obstacle
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.obstacle_markers import ObstacleMarkers
from ros_ik_pkg.ros.input.planning_scene import SceneObjects
from ros_ik_pkg.ros.interface.parameters import NO_GROUND, Settings

MOVED = 1e-4  # rad or m; joints outside the chain that move by less have not moved


class Surroundings:
    """Makes the World for each target; the same object while nothing changes."""

    def __init__(self, joint_states: JointStates) -> None:
        self.markers = ObstacleMarkers()
        self.scene = SceneObjects()
        self._joint_states = joint_states
        self._files: dict[str, tuple[Obstacle, ...]] = {'': ()}
        self._world: World | None = None
        self._positions = np.empty(0)
        self._said: tuple[str, ...] = ()

    def read(self, settings: Settings) -> None:
        """Read the obstacles_file of new settings, so that errors show before they apply; raises ModelError."""
        source = settings.obstacles_file
        self._files[source] = read_obstacles(source) if source else ()

    def world(self, arm: Arm, settings: Settings) -> tuple[World | None, tuple[str, ...]]:
        """Return the current World, or None if contact does not count, and notes."""
        if not settings.options.avoid_collisions or not arm.shaped:
            return None, ()
        outside = arm.contacts.outside
        found = self._joint_states.positions(outside) if outside else {}
        missing = tuple(name for name in outside if name not in found)
        notes = (f'no position of joint {list_names(missing)} yet: taken at rest for contact',) if missing else ()
        notes, self._said = () if missing == self._said else notes, missing
        floor = None if settings.ground <= NO_GROUND else settings.ground
        file = self._files.get(settings.obstacles_file, ())
        obstacles = (*file, *self.markers.current(), *self.scene.current())
        positions = np.array(list(found.values()))
        world = self._world
        same = (
            world is not None and world.floor == floor and world.positions.keys() == found.keys()
            and len(world.obstacles) == len(obstacles) and all(map(is_, world.obstacles, obstacles))
            and np.all(np.abs(positions - self._positions) < MOVED)
        )  # fmt: skip
        if not same:
            self._world, self._positions = World(floor, obstacles, found), positions
        return self._world, notes
