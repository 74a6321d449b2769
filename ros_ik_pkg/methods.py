"""The methods: one table, from which options, parameters, plots, the panel and the launch files derive theirs.

The compiled rule of each method is in `ik/step/methods.py`. The launch files run on a Python that may lack NumPy and
Numba, so this module imports neither.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class MethodOption:
    """An option that one method owns: SolveOptions.dls_damping and the parameter dls.damping for `damping` of dls."""

    name: str
    default: float
    text: str
    minimum: float
    maximum: float
    unit: str = ''


@dataclass(frozen=True)
class Look:
    """How plots and the panel show a method; what compiled code is kept under does not depend on it.

    Attributes
    ----------
    formula : str
        The step dq as the panel shows it.
    colour, dark_colour : str
        Its colour '#rrggbb' on light and on dark backgrounds.
    dash : matplotlib line style
        In addition to the colour, so that plots are readable in black and white.
    width : float
        Line width in plots [points].

    """

    formula: str
    colour: str
    dark_colour: str
    dash: Any = '-'
    width: float = 1.9


@dataclass(frozen=True)
class Method:
    """A step rule.

    Attributes
    ----------
    name : str
    look : Look
    options : tuple of MethodOption
    damping : callable, optional
        Returns lambda of dq = J^T (J J^T + lambda^2 I)^-1 e for SolveOptions and an error norm; None if the rule is
        another one.
    step_cap : float
        Longest step of a joint if max_joint_step is 0 [rad or m].
    may_hurry : bool
        Whether a search may give up its first descents early and take longer steps in them.
    finish_by_lm : bool
        Whether Levenberg-Marquardt may finish what a descent by this method leaves.

    """

    name: str
    look: Look
    options: tuple[MethodOption, ...] = ()
    damping: Callable[[Any, float], float] | None = None
    step_cap: float = math.inf
    may_hurry: bool = True
    finish_by_lm: bool = True


# Colours: the Okabe-Ito palette, safe for colour-blind readers; brighter on dark where it has too little contrast.
TABLE = (
    Method(
        'transpose', Look('dq = α Jᵀe', '#e69f00', '#e69f00'),
        may_hurry=False, finish_by_lm=False,  # its slow convergence is the lesson
    ),
    Method(
        'pinv', Look('dq = Jᵀ(JJᵀ)⁻¹e', '#cc79a7', '#e08fc0', dash=(0, (5, 1.5))),
        damping=lambda options, error_norm: 0.0,
    ),
    Method(
        'dls', Look('dq = Jᵀ(JJᵀ + λ²I)⁻¹e', '#0072b2', '#6c8cff', dash=(0, (1, 1))),
        options=(MethodOption('damping', 0.01, 'constant damping lambda', 0.0, 100.0),),
        damping=lambda options, error_norm: options.dls_damping,
    ),
    Method(
        'adaptive_dls', Look('dq = Jᵀ(JJᵀ + λ²I)⁻¹e, λ = max(λ₀, c‖e‖)', '#009e73', '#1fc79a', width=3.0),
        options=(
            MethodOption('damping', 1e-3, 'smallest damping lambda_0', 0.0, 100.0),
            MethodOption('gain', 0.2, 'damping over error norm, lambda = max(lambda_0, gain |e|)', 0.0, 100.0),
        ),
        damping=lambda options, error_norm: max(options.adaptive_dls_damping, options.adaptive_dls_gain * error_norm),
        step_cap=0.3,  # that of the notes
    ),
    Method(
        'sdls',
        Look('dq = clamp(Σᵢ clamp((⟨uᵢ,e⟩/sᵢ) vᵢ, γᵢ), γ)', '#56b4e9', '#56b4e9', dash=(0, (6, 1.5, 1, 1.5))),
        options=(
            MethodOption(
                'max_step', math.pi / 4, 'gamma_max, the largest joint step of one iteration', 1e-3, math.pi, 'rad'
            ),
        ),
    ),
)  # fmt: skip
METHODS = tuple(method.name for method in TABLE)
BY_NAME = {method.name: method for method in TABLE}
DEFAULT = 'adaptive_dls'
HURRIED_STRIDE = 2.0  # factor on the step cap of a method in a hurried attempt of a search: a quarter fewer steps


def option_names() -> tuple[str, ...]:
    """Return the names in SolveOptions of all options that a method owns."""
    return tuple(f'{method.name}_{option.name}' for method in TABLE for option in method.options)
