"""The main measurement: all solvers on all kinds of poses of all arms."""

from __future__ import annotations

import tempfile
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

from tqdm import tqdm

from bench.bare_arm import bare_arm
from bench.cases import make_case
from bench.judge import Judge
from bench.measure import Entry, Run, check_models, run_case
from bench.model import is_plain, make_model
from bench.process import WorkerError, WorkerProcess
from bench.solver import Model
from ros_ik_pkg.ik import Arm

Texts = dict[str, str]


def run_solves(arguments: Namespace, processes: list[WorkerProcess]) -> Iterator[tuple[list[Run], Texts, Texts]]:
    """Yield for each arm the runs, the excluded solvers with reasons, and the versions of the libraries."""
    with tempfile.TemporaryDirectory() as folder:
        for source in arguments.robots:
            arm = bare_arm(source)
            judge = Judge(arm)
            entries, absent, versions = load_all(processes, arm, make_model(arm, source, Path(folder)), arguments)
            check_models(judge, entries)
            runs = []
            for case in (make_case(arm, kind, arguments.count) for kind in arguments.cases):
                with tqdm(total=len(case) * len(entries), desc=f'{arm.name} {case.kind}', leave=False) as bar:
                    runs += run_case(judge, case, entries, bar.update) if len(case) else []
            yield runs, absent, versions


def load_all(
    processes: list[WorkerProcess], arm: Arm, model: Model, arguments: Namespace
) -> tuple[list[Entry], Texts, Texts]:
    """Load an arm in every process; return the solvers that take it, and of the others why not."""
    entries, absent, versions = [], {}, {}
    for process in processes:
        ours = process.library == 'ours'
        if not ours and not is_plain(arm):
            absent[process.library] = 'takes no mimic joints'
            continue
        try:
            names, versions[process.library] = process.load(model, arguments.set if ours else {})
        except WorkerError as problem:
            absent[process.library] = str(problem)
            continue
        entries += [Entry(name, process, name) for name in names if not ours or name in arguments.methods]
    return entries, absent, versions
