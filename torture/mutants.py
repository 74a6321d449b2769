"""Single faults in the compiled search, one at a time: `<` becomes `<=`, `+` becomes `-`, a call is left out. The
tests of the numerics must notice each of them. The sample is drawn evenly from all such changes in the functions of
`ik/step`, `ik/descent` and `ik/search`; a change that does not compile does not count. The constants at the top of the
modules are left out: they are measured choices, and a neighbouring value is not a fault. mutmut and cosmic-ray do not
fit, because they run all mutants in one tree and with one cache of compiled code; here each mutant has its own.
"""

from __future__ import annotations

import ast
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from bench.process import ROOT
from torture.plan import Check, Plan, progress, unless

COUNT = 40
ROOMS = ('step', 'descent', 'search')
TESTS = (  # those first that compile least: most mutants fail there
    'test/ik/step/test_step_rules.py', 'test/ik/search/test_compiled_check.py', 'test/ik/search/test_reach.py',
    'test/ik/search/test_starts.py', 'test/ik/step', 'test/ik/descent', 'test/ik/search',
    'test/ik/test_bad_inputs.py', 'test/ik/test_notes.py', 'test/ik/test_solver.py', 'test/ik/test_tips.py',
)  # fmt: skip
COPIED = ('ros_ik_pkg', 'bench', 'config', 'docs', 'launch', 'test', 'package.xml', 'pyproject.toml', 'setup.cfg')
NO_MUTANT_SIGNS = ('numba.core.errors', 'SyntaxError', 'UnboundLocalError')  # of a change that does not compile
NO_MUTANT, SURVIVED = 'no mutant', 'no test notices'
SWAPS: dict[type, str] = {
    ast.Lt: '<=', ast.LtE: '<', ast.Gt: '>=', ast.GtE: '>', ast.Eq: '!=', ast.NotEq: '==',
    ast.Add: '-', ast.Sub: '+', ast.Mult: '/', ast.Div: '*', ast.BitAnd: '|', ast.BitOr: '&',
    ast.And: 'or', ast.Or: 'and',
}  # fmt: skip
NAMES = {'min': 'max', 'max': 'min'}
# Survivors that compute the same, or the same but for time: the line as it is, the line as it becomes, and why.
EQUAL: dict[tuple[str, str], str] = {
    ('ratio = 2.0', 'ratio = 4.0'): 'where an iteration begins that converges from anywhere',
    ('largest, total = 0.0, 0.0', 'largest, total = 0.0, 1.0'): 'the total only tells whether all are finite',
    ('if abs(q[i] - preferences.reference[i]) > tuning.max_joint_jump:',
     'if abs(q[i] - preferences.reference[i]) >= tuning.max_joint_jump:'): 'a jump that equals the bound in all bits',
    ('if recorder is not None and recording:', 'if recorder is not None or recording:'):
        'a recorder without rows writes none, in more time',
    ('nothing = shaped(work.q, 0, (0,))', 'nothing = shaped(work.q, 1, (0,))'): 'an array of no elements is nowhere',
    ('return row[n + STATUS] >= 0.0', 'return row[n - STATUS] >= 0.0'): 'STATUS is 0',
    ('recording = recorder is not None and len(recorder.rows) > 0',
     'recording = recorder is not None or len(recorder.rows) > 0'): 'a recorder without rows writes none, in more time',
    ('added if weights[0] > 0.0 else 1.0, added if weights[1] > 0.0 else 1.0, added if weights[2] > 0.0 else 1.0,',
     'added if weights[0] > 0.0 else 2.0, added if weights[1] > 0.0 else 1.0, added if weights[2] > 0.0 else 1.0,'):
        'the row of the system is zero beside the diagonal and on the right side',
    ('if not (free[1] > 0.0 and abs(m) * half < math.pi):',
     'if not (free[1] >= 0.0 and abs(m) * half < math.pi):'):
        'then the two quaternions of the goal span what one did, and the score counts their squares together',
    ('return 0.5 * (along[0] + along[1]) if total < 1e-12 else (along[0] * away[1] + along[1] * away[0]) / total',
     'return 0.5 * (along[0] + along[1]) if total < 2e-12 else (along[0] * away[1] + along[1] * away[0]) / total'):
        'a length that is zero up to rounding',
    ('hurried > 0 and task.plain > 0.0 and not near_seed,',
     'hurried > 1 and task.plain > 0.0 and not near_seed,'): 'hurried is 0 or 50',
}


@dataclass(frozen=True)
class Mutant:
    """One change of a file: the characters from `start` to `end` of its text become `new`."""

    path: str
    line: int
    start: int
    end: int
    new: str
    text: str = field(repr=False)

    def change(self) -> str:
        """Return the changed text of the file."""
        return self.text[: self.start] + self.new + self.text[self.end :]

    @property
    def words(self) -> tuple[str, str]:
        """The line before and after the change."""
        before, after = (text.splitlines()[self.line - 1].strip() for text in (self.text, self.change()))
        return before, after

    def __str__(self) -> str:
        return f'{Path(self.path).stem}:{self.line} `{self.words[0]}` to `{self.words[1]}`'


def run(plan: Plan) -> Iterator[Check]:
    """Judge as many of the mutants as the plan allows by the tests, and say which survived."""
    end = time.monotonic() + plan.seconds(float('inf'))
    mutants = find_mutants(ROOT)
    Random(plan.seed).shuffle(mutants)
    with tempfile.TemporaryDirectory(prefix='mutants') as folder:
        scratch, began = Path(folder), processor_time()
        unchanged = judge(scratch, None, None)
        yield Check('the tests on the unchanged code', 'pass', unless(unchanged == SURVIVED, unchanged))
        if unchanged != SURVIVED:
            return
        limit = 60.0 + 3.0 * (processor_time() - began)
        outcomes: list[tuple[Mutant, str]] = []
        for mutant in progress(mutants, 'mutants', plan.count or COUNT):
            outcome = judge(scratch, limit, mutant)
            print(f'{mutant}: {outcome}', file=sys.stderr, flush=True)
            outcomes += [(mutant, outcome)] if outcome != NO_MUTANT else []
            if len(outcomes) >= (plan.count or COUNT) or time.monotonic() > end:
                break
    yield from _checks(outcomes, len(mutants))


def _checks(outcomes: list[tuple[Mutant, str]], total: int) -> Iterator[Check]:
    """Return the lines of the summary."""
    survivors = [mutant for mutant, outcome in outcomes if outcome == SURVIVED]
    figure = f'{len(outcomes) - len(survivors)} of {len(outcomes)}, drawn from {total} changes'
    yield Check('mutants that a test notices', figure, unless(bool(outcomes), 'none was tried'))
    for mutant in survivors:
        yield Check(f'survivor {mutant}', EQUAL.get(mutant.words, ''), unless(mutant.words in EQUAL, 'no test notices'))


def judge(scratch: Path, limit: float | None, mutant: Mutant | None) -> str:
    """Return what the tests say of a mutant, or of the unchanged code: NO_MUTANT, SURVIVED or the test that fails.

    They may take `limit` s of processor time.
    """
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        copy = Path(folder) / 'package'
        copy_package(copy)
        if mutant:
            (copy / mutant.path).write_text(mutant.change())
        paths = os.pathsep.join([str(copy), os.environ.get('PYTHONPATH', '')])
        environment = os.environ | {'PYTHONPATH': paths, 'NUMBA_CACHE_DIR': str(Path(folder) / 'cache')}
        command = [sys.executable, '-m', 'pytest', '-q', '-x', '-p', 'no:cacheprovider', *TESTS]
        if limit:  # of processor time, which other programs do not take from it
            command = ['prlimit', f'--cpu={limit:.0f}', *command]
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True)
        if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            return 'takes for ever'
    said = done.stdout + done.stderr
    if done.returncode == 0:
        return SURVIVED
    if any(words in said for words in NO_MUTANT_SIGNS):
        return NO_MUTANT
    (failed, *_) = re.findall(r'^(?:FAILED|ERROR) (\S+)', said, re.MULTILINE) or [said[-500:]]
    return failed


def copy_package(folder: Path) -> None:
    """Copy to a folder what the tests need of the repository."""
    for name in COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns('__pycache__'))
        else:
            shutil.copy(source, folder / name)


def processor_time() -> float:
    """Return the processor time [s] of all child processes that ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def find_mutants(root: Path) -> list[Mutant]:
    """Return every change of the rooms' functions that the tables above name."""
    package = root / 'ros_ik_pkg' / 'ik'
    files = sorted(path for room in ROOMS for path in (package / room).glob('*.py'))
    return [mutant for path in files for mutant in mutants_of(path.relative_to(root).as_posix(), path.read_text())]


def mutants_of(path: str, text: str) -> Iterator[Mutant]:
    """Yield the changes of one file."""
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    functions = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
    for function in functions:
        for node in (inner for statement in function.body for inner in ast.walk(statement)):
            for start, end, new in changes(node, text, starts):
                yield Mutant(path, text[:start].count('\n') + 1, start, end, new, text)


def changes(node: ast.AST, text: str, starts: list[int]) -> Iterator[tuple[int, int, str]]:
    """Yield (start, end, new text) of each change at a node of the syntax tree."""

    def place(line: int, column: int) -> int:
        return starts[line - 1] + column  # the sources of the rooms are ASCII

    def span(part: ast.AST) -> tuple[int, int]:
        assert isinstance(part, (ast.expr, ast.stmt)) and part.end_lineno and part.end_col_offset
        return place(part.lineno, part.col_offset), place(part.end_lineno, part.end_col_offset)

    def between(left: ast.AST, right: ast.AST, operator: ast.AST) -> Iterator[tuple[int, int, str]]:
        new = SWAPS.get(type(operator))
        gap = re.search(r'[^\s()]+', text[span(left)[1] : span(right)[0]])
        if new and gap:
            yield span(left)[1] + gap.start(), span(left)[1] + gap.end(), new

    if isinstance(node, ast.Compare):
        for left, operator, right in zip([node.left, *node.comparators], node.ops, node.comparators):
            yield from between(left, right, operator)
    elif isinstance(node, ast.BinOp):
        yield from between(node.left, node.right, node.op)
    elif isinstance(node, ast.AugAssign):
        yield from ((start, end, f'{new}=') for start, end, new in between(node.target, node.value, node.op))
    elif isinstance(node, ast.BoolOp):
        yield from between(node.values[0], node.values[1], node.op)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub)):
        yield span(node)[0], span(node)[0] + len('not ' if isinstance(node.op, ast.Not) else '-'), ''
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield *span(node), repr(node.value + 1 if isinstance(node.value, int) else 2.0 * node.value or 1.0)
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield *span(node), repr(not node.value)
    elif isinstance(node, ast.Name) and node.id in NAMES:
        yield *span(node), NAMES[node.id]
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield *span(node), 'pass'
