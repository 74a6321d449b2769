"""The certain bound of the distance of two convex bodies; judged by coal."""

from __future__ import annotations

import numpy as np
import pytest

from ros_ik_pkg.ik.collision.convex_distance import SCRATCH, hull_distance
from ros_ik_pkg.ik.collision.cover import FEW_POINTS, cover_points
from ros_ik_pkg.ik.contacts.coal_library import coal, convex
from ros_ik_pkg.ik.kernel.compiled import compiled

HERE = np.array([1.0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0])


@compiled
def bounds(vertices, count, pose, other_pose, clear, touch, guess):
    out, work = np.empty(6), np.empty(SCRATCH)
    lower, upper = hull_distance(
        vertices, 0, count, pose, count, vertices.shape[1] - count, other_pose, clear, touch, guess, out, work)
    return lower, upper, out


def bound(one, other, pose=HERE, other_pose=HERE, clear=np.inf, touch=-np.inf, guess=(1.0, 0.2, 0.1)):
    vertices = np.ascontiguousarray(np.vstack([one, other]).T)
    return bounds(vertices, len(one), pose, other_pose, clear, touch, np.array(guess))


def turned(rng):
    """Return a random pose as coal and as the compiled code have it."""
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    R *= np.sign(np.linalg.det(R))
    p = rng.normal(size=3) * 0.3
    return coal.Transform3s(R, p), np.concatenate([R.ravel(), p])


def test_the_bounds_enclose_the_distance_that_coal_finds():
    rng = np.random.default_rng(0)
    apart = 0
    for _ in range(1500):
        one, other = (rng.normal(size=(rng.integers(4, 60), 3)) * 0.1 for _ in range(2))
        (a, pose), (b, other_pose) = turned(rng), turned(rng)
        truth = coal.distance(convex(one), a, convex(other), b, coal.DistanceRequest(), coal.DistanceResult())
        lower, upper, points = bound(one, other, pose, other_pose, guess=tuple(rng.normal(size=3)))
        assert lower <= max(truth, 0.0) + 1e-7 and upper >= max(truth, 0.0) - 1e-7
        assert upper - lower < 1e-6
        if truth > 1e-6:
            apart += 1
            assert abs(np.linalg.norm(points[:3] - points[3:]) - truth) < 1e-6
    assert 300 < apart < 1400


@pytest.mark.parametrize('one', [np.zeros((1, 3)), np.array([[0.0, 0, 0], [0.0, 0, 1]]),
                                 np.array([[0.0, 0, 0], [0.0, 0, 1], [0.0, 1, 0]]), np.zeros((7, 3))],
                         ids=['point', 'segment', 'triangle', 'seven times the same point'])
def test_bodies_without_volume_have_their_distance(one):
    other = np.array([[0.5, 0.0, 0.0], [0.5, 0.0, 1.0], [0.5, 1.0, 0.0], [2.0, 0.0, 0.0]])
    for guess in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.3, 1.0)):
        lower, upper, _ = bound(one, other, guess=guess)
        assert abs(lower - 0.5) < 1e-6 and abs(upper - 0.5) < 1e-6


def test_a_wrong_first_guess_never_makes_the_bound_too_large():
    rng = np.random.default_rng(1)
    box = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.1
    for _ in range(500):
        gap = rng.uniform(0.0, 0.05)
        other = box + np.array([0.2 + gap, 0.0, 0.0])
        lower, _, _ = bound(box, other, clear=rng.uniform(0.0, 0.1), guess=rng.normal(size=3))
        assert lower <= gap + 1e-9


def test_the_search_ends_early_where_the_answer_is_known():
    box = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.1
    lower, upper, _ = bound(box, box + np.array([0.5, 0.05, 0.02]), clear=0.1, guess=(-1.0, 0.0, 0.0))
    assert 0.1 < lower <= 0.3 and upper == np.inf


@pytest.mark.parametrize('count', [9, 40, 300, 2000])
def test_both_covers_of_points_hold_them_all(count):
    rng = np.random.default_rng(count)
    points = rng.normal(size=(count, 3))
    points *= 0.1 / np.linalg.norm(points, axis=1)[:, None]  # all are corners of the hull
    cover = cover_points(points)
    assert cover.few == min(FEW_POINTS, len(cover.points))
    for few, radius in ((cover.few, cover.radius), (len(cover.points), cover.fine_radius)):
        body = convex(cover.points[:few])
        gaps = [coal.distance(body, coal.Transform3s(), coal.Sphere(1e-6), coal.Transform3s(np.eye(3), point),
                              coal.DistanceRequest(), coal.DistanceResult()) for point in points]
        assert max(gaps) < radius + 1e-6
    assert cover.fine_radius < 0.012 and cover.radius >= cover.fine_radius


def test_a_cover_of_flat_points_holds_them_all():
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (500, 3)) * [1.0, 1.0, 0.0]
    cover = cover_points(points)
    for point in points:
        assert bound(cover.points, point[None])[1] <= cover.fine_radius + 1e-7
