"""docs/known_complaints.md: every example does what the page says, and would fail with a solver that only says so."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ros_ik_pkg.ik import Status

pytestmark = pytest.mark.once

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'known_complaints.md'
HEAD, *SECTIONS = re.split(r'^### ', PAGE.read_text(), flags=re.M)
LINK = re.compile(r'\[([\w.-]+) (\d+)\]\((https://github\.com/[\w.-]+/([\w.-]+)/(?:issues|pull)/(\d+))\): ')
TITLES = {section.splitlines()[0]: section for section in SECTIONS}


def blocks(text: str) -> list[str]:
    return re.findall(r'^```python\n(.*?)^```', text, re.M | re.S)


def shared() -> dict:
    """Return the names that all examples share."""
    names: dict = {}
    (block,) = blocks(HEAD)
    exec(compile(block, PAGE.name, 'exec'), names)
    return names


def run(section: str, names: dict) -> None:
    (block,) = blocks(section)
    exec(compile(block, PAGE.name, 'exec'), names)


def liar(arm, target, seed=None, options=None, **_):
    """Stand for a solver that returns where it starts, and says that this is the solution."""
    q = np.array(arm.home if seed is None else seed, dtype=float)
    return SimpleNamespace(
        q=q, converged=True, status=Status.CONVERGED, attempts=1, position_error=0.0, sigma_min=0.0, solutions=q[None]
    )


def test_there_are_thirty_of_different_threads_each_with_an_example_that_asserts_something():
    links = [LINK.findall(section) for section in SECTIONS]
    assert len(SECTIONS) == len(TITLES) == len({found[0][2] for found in links}) == 30
    for found, section in zip(links, SECTIONS):
        (name, number, _, repository, thread), = found
        assert (name, number) == (repository, thread)
        assert 'assert ' in blocks(section)[0]


@pytest.mark.parametrize('title', TITLES)
def test_the_example_does_what_the_page_says(title):
    run(TITLES[title], shared())


@pytest.mark.parametrize('title', [title for title, section in TITLES.items() if re.search(r'solve|reaches', section)])
def test_the_example_fails_with_a_solver_that_does_nothing(title, monkeypatch):
    names = shared()
    names['solve'] = liar
    names['solve_path'] = lambda arm, poses, seed: SimpleNamespace(
        complete=True, reconfigurations=(), velocities=np.zeros((2, arm.n)), q=np.array([seed, seed]), breaks=()
    )
    monkeypatch.setattr('ros_ik_pkg.adapters.lerobot.solve', liar)
    with pytest.raises((AssertionError, AttributeError)):  # it has no trace to show
        run(TITLES[title], names)
