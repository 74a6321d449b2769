"""Differential inverse kinematics of Pink and mink that keeps away from contact, step after step from the seed.

Runs in the environment of the peers: `python -m bench.collision_loops LIBRARY TASK.json FOUND.npz`.
"""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

STEPS = 200  # at most
PERIOD = 0.1  # s of one step
NEAR = 0.001  # m that they keep away
TOLERANCE = 1e-4  # m, rad

Step = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # goes one step towards a target; q and error (6,) there


def main(library: str, task_file: str, found_file: str) -> None:
    """Solve all targets; write configurations (k, n), NaN where none is found, and seconds (k,)."""
    task = json.loads(Path(task_file).read_text())
    begin, step = {'pink': make_pink, 'mink': make_mink}[library](task)
    targets = np.array(task['targets'])
    found, seconds = np.full((len(targets), len(task['joints'])), np.nan), np.empty(len(targets))
    for k, target in enumerate(targets):
        began = time.thread_time()
        begin()
        for _ in range(STEPS):
            try:
                q, error = step(target)
            except Exception:  # the solver of the quadratic program finds no step
                break
            if max(np.linalg.norm(error[:3]), np.linalg.norm(error[3:])) < TOLERANCE:
                found[k] = q
                break
        seconds[k] = time.thread_time() - began
    np.savez(found_file, q=found, seconds=seconds)


def make_pink(task: dict[str, Any]) -> tuple[Callable[[], None], Step]:
    """Return what goes back to the seed, and one step of Pink with a SelfCollisionBarrier over all pairs."""
    import coal
    import pinocchio as pin
    from pink import Configuration, solve_ik
    from pink.barriers import SelfCollisionBarrier
    from pink.limits import ConfigurationLimit
    from pink.tasks import FrameTask

    whole = pin.buildModelFromUrdf(task['urdf'])
    shapes = pin.buildGeomFromUrdf(whole, task['urdf'], pin.GeometryType.COLLISION, package_dirs=[task['share']])
    names = [whole.frames[shape.parentFrame].name for shape in shapes.geometryObjects]
    for shape in shapes.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase):  # the distance must be that of convex bodies
            shape.geometry.buildConvexHull(False, 'Qt')
            shape.geometry = shape.geometry.convex
    for name, size, pose in task['boxes']:
        base = whole.getFrameId(task['base'])
        placement = whole.frames[base].placement * pin.SE3(np.array(pose))
        joint = whole.frames[base].parentJoint
        shapes.addGeometryObject(pin.GeometryObject(name, joint, base, placement, coal.Box(*size)))
        names.append(name)
    locked = [whole.getJointId(name) for name in whole.names[1:] if name not in task['joints']]
    model, shapes = pin.buildReducedModel(whole, shapes, locked, pin.neutral(whole))
    wanted = {frozenset(pair) for pair in task['pairs']}
    for i, j in combinations(range(len(names)), 2):
        if frozenset((names[i], names[j])) in wanted:
            shapes.addCollisionPair(pin.CollisionPair(i, j))
    order = [model.joints[model.getJointId(name)].idx_q for name in task['joints']]
    seed = np.empty(model.nq)
    seed[order] = task['seed']
    configuration = Configuration(model, model.createData(), seed, collision_model=shapes,
                                  collision_data=shapes.createData())  # fmt: skip
    frame = FrameTask(task['tip'], position_cost=1.0, orientation_cost=1.0)
    barrier = SelfCollisionBarrier(len(shapes.collisionPairs), gain=1.0, safe_displacement_gain=0.0, d_min=NEAR)
    limits = [ConfigurationLimit(model)]

    def step(target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        frame.set_target(pin.SE3(target))
        velocity = solve_ik(configuration, [frame], PERIOD, solver='daqp', barriers=[barrier], limits=limits,
                            damping=1e-8)  # fmt: skip
        configuration.integrate_inplace(velocity, PERIOD)
        return configuration.q[order], frame.compute_error(configuration)

    return lambda: configuration.update(seed), step


def make_mink(task: dict[str, Any]) -> tuple[Callable[[], None], Step]:
    """Return what goes back to the seed, and one step of mink with a CollisionAvoidanceLimit over all pairs."""
    import mink
    import mujoco

    text = Path(task['urdf']).read_text().replace('package://', f'{task["share"]}/')
    text = re.sub(r'<visual>.*?</visual>', '', text, flags=re.S)
    compiler = '<mujoco><compiler strippath="false" fusestatic="false" discardvisual="true"/></mujoco>'
    spec = mujoco.MjSpec.from_string(re.sub(r'(<robot[^>]*>)', rf'\1{compiler}', text, count=1))
    for name, size, pose in task['boxes']:
        box = spec.worldbody.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=0.5 * np.array(size))
        box.pos = np.array(pose)[:3, 3]
    model = spec.compile()
    geoms: dict[str, list[int]] = {}
    for k in range(model.ngeom):
        body = model.body(model.geom_bodyid[k]).name
        name = model.geom(k).name or (task['base'] if body == 'world' else body)
        geoms.setdefault(name, []).append(k)
    pairs = [(geoms[one], geoms[other]) for one, other in task['pairs'] if one in geoms and other in geoms]
    order = [model.joint(name).qposadr[0] for name in task['joints']]
    seed = np.zeros(model.nq)
    seed[order] = task['seed']
    configuration = mink.Configuration(model)
    frame = mink.FrameTask(task['tip'], 'body', 1.0, 1.0, lm_damping=1.0)  # as in its examples
    limits = [mink.ConfigurationLimit(model), mink.CollisionAvoidanceLimit(
        model, pairs, minimum_distance_from_collisions=NEAR, collision_detection_distance=0.1)]  # fmt: skip

    def step(target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        frame.set_target(mink.SE3.from_matrix(target))
        velocity = mink.solve_ik(configuration, [frame], PERIOD, 'daqp', damping=1e-8, limits=limits)
        configuration.integrate_inplace(velocity, PERIOD)
        return configuration.q[order], frame.compute_error(configuration)

    return lambda: configuration.update(seed), step


if __name__ == '__main__':
    main(*sys.argv[1:])
