"""The node in other locales, time zones and hash seeds: its answers are the same to the last bit."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping

from ros_ik_pkg.ik import Arm
from torture.peer import connected
from torture.plan import Check, progress, skipped, unless
from torture.running import LOCALIZED_NODE, running_node

HABITATS = (
    {'LC_ALL': 'C'},
    {'LC_ALL': 'C.UTF-8', 'TZ': 'Pacific/Kiritimati'},
    {'LC_ALL': 'de_DE.UTF-8', 'PYTHONHASHSEED': '0'},
    {'LC_ALL': 'tr_TR.UTF-8', 'PYTHONHASHSEED': '4294967295', 'TZ': ''},
    {'PYTHONHASHSEED': '1', 'TZ': 'America/St_Johns', 'PYTHONUTF8': '0'},
)
WITH_COMMA = ('de_DE', 'tr_TR')  # with a decimal comma


def habitats(arm: Arm) -> Iterator[Check]:
    """Start the node in each environment; compile a missing locale temporarily, if possible."""
    usual, fault = answer_in(arm, {})
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
        for habitat in progress(HABITATS, 'locales'):
            what = ' '.join(f'{name}={value}' for name, value in habitat.items())
            where, reason = find_locale(habitat.get('LC_ALL', 'C'), folder)
            if reason:
                yield skipped(what, reason)
                continue
            answer, wrong = answer_in(arm, {**habitat, **where})
            differs = unless(answer == usual, f'{answer} instead of {usual}')
            yield Check(what, 'the same bits', fault or wrong or differs)


def find_locale(name: str, folder: str) -> tuple[dict[str, str], str]:
    """Return the environment variables for a locale, and why it is unavailable (empty if it is available)."""
    code = f'import locale; locale.setlocale(locale.LC_ALL, {name!r})'
    if subprocess.run([sys.executable, '-c', code], capture_output=True).returncode == 0:
        return {}, ''
    if not shutil.which('localedef'):
        return {}, 'not installed'
    language, _, characters = name.partition('.')
    # Warnings make it end with 1 although it has written everything; whether it has, the node will say.
    done = subprocess.run(['localedef', '-i', language, '-f', characters, f'{folder}/{name}'], capture_output=True)
    return {'LOCPATH': folder}, '' if done.returncode in (0, 1) else 'not installed'


def answer_in(arm: Arm, environment: Mapping[str, str]) -> tuple[list[float], str]:
    """Return the joints that a node in this environment finds, and the fault."""
    with running_node(program=LOCALIZED_NODE, **environment) as node, connected(arm) as peer:
        fault = peer.fault(arm.home + 0.3) or node.fault() or _not_in_it(environment.get('LC_ALL', ''), node.said())
        return [] if fault else list(peer.solutions[max(peer.solutions)].position), fault


def _not_in_it(name: str, said: str) -> str:
    """Say that the node is not in the locale that it should be in."""
    half = '0,5' if name.startswith(WITH_COMMA) else '0.5'
    lines = [line for line in said.splitlines() if line.startswith('locale: ')]
    return unless(any(name in line and line.endswith(f' writes {half}') for line in lines), f'another locale: {lines}')
