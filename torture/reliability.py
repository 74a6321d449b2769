"""docs/reliability.md: the last result of every section, with its date and machine."""

from __future__ import annotations

import re
from pathlib import Path

from bench import machine

INTRODUCTION = """# Reliability

Written by `scripts/torture`, section by section; run it again instead of editing this. Each section shows its last run.
"""
HEADING = re.compile(r'^## ', re.M)


class Reliability:
    """The section of one run; date and load are those of its begin."""

    def __init__(self, name: str, command: str) -> None:
        self._name = name
        self._machine = machine.describe(command)[1:]

    def write(self, path: Path, text: str, table: str) -> None:
        """Put the section into the report, in place of the one that was there; the others stay."""
        about = '\n'.join(f'- {what}: {value}' for what, value in self._machine)
        sections = _sections(path)
        sections[self._name] = f'{self._name}\n\n{text.strip()}\n\n{table}\n\n{about}\n'
        path.write_text('\n'.join([INTRODUCTION, *(f'## {section}' for section in sections.values())]))


def _sections(path: Path) -> dict[str, str]:
    """Return the sections of the report by name, in their order."""
    if not path.exists():
        return {}
    parts = HEADING.split(path.read_text())[1:]
    return {part.splitlines()[0]: part.rstrip() + '\n' for part in parts}
