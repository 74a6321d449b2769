"""What happened, in words: one sentence about a comparison, in English or Polish."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.ik import Status

LANGUAGES = ('en', 'pl')
SINGULAR = 1e-2  # a smaller singular value of the Jacobian is worth telling; a larger one is no reason to fail
ROUNDING = 5e-7  # m; less is no distance to speak of
MANY = 2  # joints at their limits; more are counted, not named

_TEXTS = {
    'en': {
        Status.CONVERGED: 'converged in {count} iterations',
        Status.MAX_ITERATIONS: 'ran out of its {count} iterations {off}',
        Status.STALLED: 'stalled {when}, {off}{limits}',
        Status.OSCILLATING: 'oscillates {off}{limits}',
        Status.DIVERGED: 'diverged {when}{why}',
        Status.NOT_FINITE: 'found no finite step {when}{why}',
        'all': '{runs} converged',
        'in': '{method} in {count}',
        'when': 'at iteration {count}',
        'at once': 'at its first step',
        'off': '{distance} from the target',
        'singular': 'smallest singular value {sigma}',
        'one limit': '{joints} at its limit',
        'limits': '{joints} at their limits',
        'many limits': '{count} joints at their limits',
        'and': 'and',
    },
    'pl': {
        Status.CONVERGED: 'zbiega w {count} iteracjach',
        Status.MAX_ITERATIONS: 'wyczerpuje swoje {count} iteracji {off}',
        Status.STALLED: 'utyka {when}, {off}{limits}',
        Status.OSCILLATING: 'oscyluje {off}{limits}',
        Status.DIVERGED: 'rozbiega się {when}{why}',
        Status.NOT_FINITE: 'nie znajduje skończonego kroku {when}{why}',
        'all': 'zbiegają: {runs}',
        'in': '{method} (iteracji: {count})',
        'when': 'w iteracji {count}',
        'at once': 'w pierwszym kroku',
        'off': '{distance} od celu',
        'singular': 'najmniejsza wartość osobliwa {sigma}',
        'one limit': '{joints} na ograniczeniu',
        'limits': '{joints} na ograniczeniach',
        'many limits': 'przegubów na ograniczeniach: {count}',
        'and': 'i',
    },
}
_OTHER_STATUSES = {
    'pl': {
        Status.DEADLINE: 'przekracza dozwolony czas',
        Status.UNREACHABLE: 'nie sięga celu: nie prowadzi do niego żadne położenie przegubów w granicach',
        Status.COLLISION: 'ma rozwiązania, lecz każde dotyka robota albo otoczenia',
        Status.JOINT_JUMP: 'ma rozwiązania, lecz każde leży dalej niż pozwala max_joint_jump',
    }
}


def describe(runs: Sequence[MethodRun], language: str = 'en') -> str:
    """Say which methods failed and how, then which converged, the quickest first."""
    texts = _TEXTS[language]
    failed = [describe_run(run, language) for run in runs if run.status is not Status.CONVERGED]
    converged = sorted((run for run in runs if run.status is Status.CONVERGED), key=lambda run: run.iterations)
    if converged:
        names = [texts['in'].format(method=run.method, count=run.iterations) for run in converged]
        failed.append(texts['all'].format(runs=_and(names, language)))
    return '; '.join(failed)


def describe_run(run: MethodRun, language: str = 'en') -> str:
    """Say how one method ended, such as 'pinv diverged at iteration 7: smallest singular value 0.0002'."""
    text = _TEXTS[language].get(run.status) or _OTHER_STATUSES.get(language, {}).get(run.status, run.status.text)
    parts = {
        'count': run.iterations,
        'off': _off(run, language),
        'when': _when(run, language),
        'why': _why(run, language),
        'limits': _limits(run, ', ', language),
    }
    return f'{run.method} {text.format(**parts)}'


def _when(run: MethodRun, language: str) -> str:
    return _TEXTS[language]['when' if run.iterations else 'at once'].format(count=run.iterations)


def _off(run: MethodRun, language: str) -> str:
    """Say how far the tip is from the target: the distance, and the angle if there is no distance."""
    near = run.position_error <= ROUNDING
    distance = angle(run.orientation_error) if near else length(run.position_error)
    return _TEXTS[language]['off'].format(distance=distance)


def _why(run: MethodRun, language: str) -> str:
    """Say what made a step too long: a Jacobian that is nearly singular, or has lost the columns of joints at limits.

    The distance if it was neither.
    """
    if run.sigma_min < SINGULAR:
        singular = _TEXTS[language]['singular'].format(sigma=f'{run.sigma_min:.1g}')
        return f': {singular}{_limits(run, ", ", language)}'
    return _limits(run, ': ', language) or f', {_off(run, language)}'


def _limits(run: MethodRun, before: str, language: str) -> str:
    """Name the joints that ended at their limits, or count them if they are many; empty if none did."""
    joints, texts = run.joints_at_limits, _TEXTS[language]
    if not joints:
        return ''
    if len(joints) > MANY:
        return before + texts['many limits'].format(count=len(joints))
    return before + texts['one limit' if len(joints) == 1 else 'limits'].format(joints=_and(joints, language))


def length(metres: float) -> str:
    """Return a length in m, mm or µm."""
    for factor, unit in ((1.0, 'm'), (1e3, 'mm')):
        if metres * factor >= 0.995:
            return f'{metres * factor:.3g} {unit}'
    return f'{metres * 1e6:.3g} µm'


def angle(radians: float) -> str:
    """Write an angle in degrees, or in milliradians if it is small."""
    degrees = math.degrees(radians)
    return f'{degrees:.3g}°' if degrees >= 0.1 else f'{radians * 1e3:.2g} mrad'


def _and(items: Sequence[str], language: str) -> str:
    """Join as in a sentence."""
    if len(items) == 1:
        return items[0]
    return f'{", ".join(items[:-1])} {_TEXTS[language]["and"]} {items[-1]}'
