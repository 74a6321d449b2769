"""What a solve returns, and the words for it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from ros_ik_pkg.ik import TRACE_COLUMNS, Solution, Status, Trace
from ros_ik_pkg.ik.solution import FIGURES

DOCS = Path(__file__).resolve().parents[2] / 'docs'


def made_up(**values):
    figures = {
        'status': Status.STALLED, 'position_error': 0.1, 'orientation_error': 0.2, 'iterations': 3, 'attempts': 2,
        'joint_distance': 0.4, 'sigma_min': 0.01, 'limits_mask': 0, 'seed_clipped': False, 'solve_time': 1e-5,
    } | values  # fmt: skip
    return Solution(np.array([0.0] * 7 + [figures.get(name, np.nan) for name in FIGURES], dtype=float))


def test_every_figure_is_read_off_its_place_in_the_row():
    row = np.concatenate([np.arange(7.0), np.arange(len(FIGURES)) + 1.0])
    solution = Solution(row)
    others = ('status', 'found', 'seed_clipped', 'completeness', 'wished_rows')
    names = [name for name in FIGURES if name not in others]
    assert [getattr(solution, name) for name in names] == [FIGURES.index(name) + 1 for name in names]
    assert solution.q.tolist() == list(range(7)) and solution.status is Status.MAX_ITERATIONS
    assert solution.seed_clipped is True and not solution.converged
    assert FIGURES.index('wished_rows') + 1 == 0b001101 and solution.wished == ('x', 'z', 'rx')


def test_the_statuses_are_numbered_as_ever():
    # Programs that read traces and logs keep these numbers.
    assert [status.label for status in Status] == [
        'converged', 'max_iterations', 'stalled', 'oscillating', 'diverged', 'not_finite', 'deadline', 'unreachable',
        'joint_jump', 'collision',
    ]  # fmt: skip
    assert [int(status) for status in Status] == list(range(10))


def test_a_status_prints_as_its_word():
    assert str(Status.MAX_ITERATIONS) == f'{Status.MAX_ITERATIONS}' == 'max_iterations'
    assert f'{Status.STALLED:>9}' == '  stalled'


def test_every_status_has_a_sentence_of_its_own():
    texts = [status.text for status in Status]
    assert len(set(texts)) == len(texts)
    assert all(len(text) > 10 and text[0].islower() and text[-1] != '.' for text in texts)


@pytest.mark.parametrize('status', Status)
def test_only_converged_is_converged(status):
    assert made_up(status=status).converged == (status is Status.CONVERGED)


@pytest.mark.parametrize(('mask', 'joints'), [(0, ()), (1, (0,)), (0b1000100, (2, 6)), (0b1111111, tuple(range(7)))])
def test_joints_at_limits_are_read_off_the_mask(mask, joints):
    assert made_up(limits_mask=mask).joints_at_limits == joints


def test_the_joint_after_the_last_is_never_at_a_limit():
    assert made_up(limits_mask=1 << 7).joints_at_limits == ()


def test_a_trace_gives_its_columns_by_name():
    rows = np.arange(3.0 * len(TRACE_COLUMNS)).reshape(3, -1)
    trace = Trace(rows, np.zeros((3, 6)), np.zeros((3, 3)))
    assert len(trace) == 3
    assert not trace.truncated
    for k, name in enumerate(TRACE_COLUMNS):
        np.testing.assert_array_equal(trace.column(name), rows[:, k])
    with pytest.raises(ValueError, match='tuple'):
        trace.column('speed')


def test_a_trace_cannot_be_changed():
    trace = Trace(np.zeros((1, len(TRACE_COLUMNS))), np.zeros((1, 6)), np.zeros((1, 3)))
    with pytest.raises(dataclasses.FrozenInstanceError):
        trace.truncated = True
