"""The arms that the servo is tortured with, and its settings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.published_robots import PANDA, UR5
from ros_ik_pkg.ik import Arm, SolveOptions, load_arm
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds

RATE, PER_COMMAND = 500.0, 5  # Hz, and periods from one command to the next
PERIOD = 1.0 / RATE
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=RATE)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
BASE = np.eye(3)
PANDA_START = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
UR5_START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
TILT = (1, 1, 1, 1, 0, 1)  # the rows that five joints can follow
POSITION = (1, 1, 1, 0, 0, 0)


class Case(NamedTuple):
    """An arm, where it starts (n,) [rad], how it solves, and its URDF if that has shapes."""

    arm: Arm
    start: np.ndarray
    options: SolveOptions
    urdf: Path | None


def arms() -> dict[str, Case]:
    """Return the arms by name."""
    (panda, panda_srdf, hand), (ur5, ur5_srdf, end), so101 = PANDA, UR5, load_arm('so101')
    return {
        'panda': Case(load_arm(panda, tip=hand, srdf=panda_srdf), PANDA_START, SolveOptions(), panda),
        'ur5': Case(load_arm(ur5, tip=end, srdf=ur5_srdf), UR5_START, SolveOptions(), ur5),
        'five joints': Case(
            load_arm(ur5, tip='wrist_2_link', srdf=ur5_srdf), UR5_START[:5],
            SolveOptions(task_weights=TILT, task_frame='tip'), ur5,
        ),
        'so101': Case(so101, so101.home, SolveOptions(task_weights=POSITION), None),
    }  # fmt: skip
