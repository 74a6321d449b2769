"""docs/reliability.md: the last result of every section, with its date and machine."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from bench import machine
from bench.process import ROOT

INTRODUCTION = """# Reliability

Written by `scripts/torture`, section by section; run it again instead of editing this. Each section shows its last full
run.
"""
HEADING = re.compile(r'^## ', re.M)
NOT_THE_CODE = ':!docs/reliability.md'  # written by the previous section
NAMED = 5  # changed files


class Reliability:
    """The section of one run; date and load are those of its begin."""

    def __init__(self, name: str, command: str) -> None:
        self._name = name
        self._machine = {**dict(machine.describe(command)[1:]), 'commit': commit()}

    def write(self, path: Path, text: str, table: str) -> None:
        """Put the section into the report, in place of the one that was there; the others stay."""
        about = '\n'.join(f'- {what}: {value}' for what, value in self._machine.items())
        sections = _sections(path)
        sections[self._name] = f'{self._name}\n\n{text.strip()}\n\n{table}\n\n{about}\n'
        path.write_text('\n'.join([INTRODUCTION, *(f'## {section}' for section in sections.values())]))


def _sections(path: Path) -> dict[str, str]:
    """Return the sections of the report by name, in their order."""
    if not path.exists():
        return {}
    parts = HEADING.split(path.read_text())[1:]
    return {part.splitlines()[0]: part.rstrip() + '\n' for part in parts}


def commit() -> str:
    """Return the tested commit, and the uncommitted changes that make it irreproducible."""
    try:
        name, changed = _git('rev-parse', '--short=12', 'HEAD'), _git('status', '--porcelain', '--', '.', NOT_THE_CODE)
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'
    files = [line[3:] for line in changed.splitlines()]
    more = f' and {len(files) - NAMED} more' if len(files) > NAMED else ''
    return name.strip() + (f', not committed: {", ".join(files[:NAMED])}{more}' if files else '')


def _git(*words: str) -> str:
    return subprocess.run(['git', '-C', str(ROOT), *words], check=True, capture_output=True, text=True).stdout
