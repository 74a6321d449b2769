"""A notebook of one comparison that runs without ROS: problem, table, curves, the inside of an iteration."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ros_ik_pkg.compare.problem import Problem
from ros_ik_pkg.ik import METHODS, SolveOptions
from ros_ik_pkg.methods import option_names

FORMAT = 4, 5  # of nbformat


def save_notebook(path: Path, problem: Problem, robot: str, methods: Sequence[str], options: SolveOptions) -> None:
    """Write the notebook; `robot` is what load_arm takes."""
    cells = [_cell(kind, text, k) for k, (kind, text) in enumerate(_contents(problem, robot, methods, options))]
    metadata = {'kernelspec': {'display_name': 'Python 3', 'language': 'python', 'name': 'python3'}}
    book = {'cells': cells, 'metadata': metadata, 'nbformat': FORMAT[0], 'nbformat_minor': FORMAT[1]}
    path.write_text(json.dumps(book, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')


def _cell(kind: str, text: str, number: int) -> dict[str, Any]:
    cell: dict[str, Any] = {
        'cell_type': kind, 'id': f'cell{number}', 'metadata': {}, 'source': text.splitlines(keepends=True)
    }  # fmt: skip
    return cell | ({'execution_count': None, 'outputs': []} if kind == 'code' else {})


def _contents(
    problem: Problem, robot: str, methods: Sequence[str], options: SolveOptions
) -> list[tuple[str, str]]:
    changed = {
        name: value for name, value in (
            (name, getattr(options, name)) for name in ('max_iterations', 'position_tolerance', 'orientation_tolerance',
                                                        'step_size', *option_names())
        ) if value != getattr(SolveOptions(), name)
    }  # fmt: skip
    arguments = ', '.join(f'{name}={value!r}' for name, value in changed.items())
    return [
        ('markdown', f'# Jacobian methods side by side: {problem.arm.name}\n\n'
         'One seed, one target, one descent of each method. Change a number and run the cells again.'),
        ('code', 'import numpy as np\n'
         'from ros_ik_pkg.compare import compare_methods, describe\n'
         'from ros_ik_pkg.compare.iterate import make_iterate\n'
         'from ros_ik_pkg.ik import SolveOptions, load_arm\n\n'
         f'arm = load_arm({robot!r})\n'
         f'seed = np.array({problem.seed.round(12).tolist()})  # rad, m\n'
         f'target = np.array({problem.target.round(12).tolist()})\n'
         f'options = SolveOptions({arguments})\n'
         f'runs = compare_methods(arm, target, seed, {list(methods)!r}, options)'),
        ('markdown', '## What each method made of it'),
        ('code', 'for run in runs:\n'
         "    print(f'{run.method:13} {run.iterations:5} steps  {run.position_error:.1e} m  "
         "{run.orientation_error:.1e} rad  {run.status}')\n"
         "print()\nprint(describe(runs))"),
        ('markdown', '## The errors fall\n\nA straight line falls by a constant factor, a curve that bends down '
         'quadratically.'),
        ('code', 'import matplotlib.pyplot as plt\n\n'
         'for run in runs:\n'
         "    plt.semilogy(run.trace.column('iteration'), run.trace.column('error_norm'), label=run.method)\n"
         "plt.xscale('symlog', linthresh=10)\nplt.xlabel('iteration')\nplt.ylabel('error norm')\n"
         'plt.legend()\nplt.show()'),
        ('markdown', '## The inside of one iteration\n\nThe error along each singular direction of the Jacobian, and '
         'what a method multiplies it with.'),
        ('code', 'run = runs[0]\n'
         'iterate = make_iterate(arm, target, run.method, options, run.trace.joint_positions, 0)\n'
         'directions = iterate.directions\n'
         "print('singular values', directions.sigma.round(4))\n"
         "print('error along   ', directions.component.round(4))\n"
         f'for method in {METHODS!r}:\n'
         "    print(f'{method:13} gains', directions.gains(method, options).round(3))"),
    ]  # fmt: skip
