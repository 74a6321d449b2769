"""The phenomena that the lecture notes name, each as a problem on which it occurs, and what to watch.

`test/compare/test_lessons.py` shows that each phenomenon really occurs with these numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ros_ik_pkg.compare.problem import NOTES_ROBOT, NOTES_SEED, NOTES_TARGET, Problem, joints_from_degrees, pose
from ros_ik_pkg.ik import METHODS, SolveOptions, load_arm

# Parameters, by their ROS names, that a lesson starts from; what a lesson changes, the next one sets back.
START: dict[str, Any] = {
    'method': 'adaptive_dls',
    'max_iterations': 2000,
    'max_attempts': 500,
    'position_tolerance': 1e-6,
    'orientation_tolerance': 1e-6,
    'step_size': 1.0,
    'dls.damping': 0.01,
    'adaptive_dls.damping': 1e-3,
    'adaptive_dls.gain': 0.2,
    'sdls.max_step': float(np.pi / 4),
    'null_space': 'none',
    'posture': [],
}


@dataclass(frozen=True)
class Lesson:
    """One phenomenon.

    Attributes
    ----------
    name : str
    watch : str
        The method whose iterations show it.
    seed : tuple
        Joint positions [deg, m].
    target : tuple
        x y z [m], roll pitch yaw [deg]; or, if it has `tip_at`, not used.
    tip_at : tuple
        Joint positions [deg, m] whose pose is the target; empty if `target` gives it.
    shift : float
        How far the target lies along `along` from there [m].
    parameters : mapping
        By ROS name; the others are those of START.
    title, text : mapping of language to str
        The text says in three sentences what to watch.

    """

    name: str
    watch: str
    title: Mapping[str, str]
    text: Mapping[str, str]
    robot: str = NOTES_ROBOT
    seed: tuple[float, ...] = NOTES_SEED
    target: tuple[float, ...] = NOTES_TARGET
    tip_at: tuple[float, ...] = ()
    shift: tuple[float, ...] = (0.0, 0.0, 0.0)
    methods: tuple[str, ...] = METHODS
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def problem(self) -> Problem:
        """Return arm, seed and target."""
        arm = load_arm(self.robot)
        seed = joints_from_degrees(arm, self.seed)
        if not self.tip_at:
            return Problem(arm, seed, pose(self.target))
        target = arm.forward(joints_from_degrees(arm, self.tip_at))
        target[:3, 3] += self.shift
        return Problem(arm, seed, target)

    def values(self) -> dict[str, Any]:
        """Return the node's parameters for this lesson, by ROS name."""
        return {**START, **self.parameters}

    def options(self) -> SolveOptions:
        """Return the same as options of a solve."""
        return SolveOptions(**{name.replace('.', '_'): value for name, value in self.values().items()})


# The elbow straight, the wrist bent: the singular direction of the task points from the shoulder to the wrist.
STRETCHED = (11.4592, -40.1070, -87.3080, 17.1887, 34.3775, 5.7296)
INWARDS = (-0.07133, -0.02911, -0.06375)  # 0.1 m along that direction, towards the shoulder

LESSONS = (
    Lesson(
        'quadratic',
        'pinv',
        {'en': 'Quadratic convergence', 'pl': 'Zbieżność kwadratowa'},
        {
            'en': 'Step through the last iterations of pinv: the exponent of the error doubles with every step. '
            'This is Newton’s method once the linear model holds. '
            'The transpose, which follows the gradient alone, still needs a thousand steps for the same target.',
            'pl': 'Przejdź przez ostatnie iteracje pinv: wykładnik błędu podwaja się z każdym krokiem. '
            'To metoda Newtona, gdy model liniowy jest już dobry. '
            'Transpozycja, która zna tylko gradient, potrzebuje do tego samego celu jeszcze tysiąca kroków.',
        },
        target=(0.45, 0.2, 0.4, 0.0, 90.0, 0.0),
        parameters={'position_tolerance': 1e-12, 'orientation_tolerance': 1e-12},
    ),
    Lesson(
        'wrist',
        'pinv',
        {'en': 'Divergence at the wrist', 'pl': 'Rozbieżność w nadgarstku'},
        {
            'en': 'Joint 5 is nearly straight, so axes 4 and 6 nearly coincide and one singular value is almost zero. '
            'pinv divides the error along that direction by it and asks for a step of many turns. '
            'The damped methods leave that direction alone and arrive; look at the gains in the chart.',
            'pl': 'Przegub 5 jest prawie wyprostowany, osie 4 i 6 prawie się pokrywają i jedna wartość osobliwa '
            'jest bliska zera. '
            'pinv dzieli przez nią błąd w tym kierunku i żąda kroku o wiele obrotów. '
            'Metody tłumione zostawiają ten kierunek w spokoju i dochodzą do celu; spójrz na wzmocnienia na wykresie.',
        },
        seed=(2.8, -77.7, 6.8, 8.5, 0.1, 172.0),
        target=(0.57864, 0.22864, 0.37864, 178.5497, 70.7947, -178.7201),
    ),
    Lesson(
        'oscillation',
        'transpose',
        {'en': 'Oscillation of the transpose', 'pl': 'Oscylacje transpozycji'},
        {
            'en': 'With step_size 2 the transpose takes twice the step that is best along its gradient. '
            'The error rises and falls from one iteration to the next and never gets small. '
            'Set the step size back to 1 and it converges, slowly.',
            'pl': 'Przy step_size 2 transpozycja robi krok dwa razy dłuższy niż najlepszy wzdłuż gradientu. '
            'Błąd rośnie i maleje z iteracji na iterację i nigdy nie staje się mały. '
            'Ustaw krok z powrotem na 1, a metoda zbiegnie, choć powoli.',
        },
        methods=('transpose',),
        # One descent for the node as well: its search would go on for thousands of steps.
        parameters={'step_size': 2.0, 'method': 'transpose', 'max_attempts': 1},
    ),
    Lesson(
        'stagnation',
        'transpose',
        {'en': 'Stagnation', 'pl': 'Stagnacja'},
        {
            'en': 'The arm is stretched out and the target lies 10 cm further in, on the line to the shoulder. '
            'No joint moves the tip along that line, so Jᵀe is zero although e is not: the transpose and sdls stand '
            'still, and pinv finds no finite step. '
            'Turn joint 3 of the seed back by ten degrees, to −97°, and all of them arrive.',
            'pl': 'Ramię jest wyprostowane, a cel leży 10 cm bliżej, na prostej do barku. '
            'Żaden przegub nie porusza końcówki wzdłuż tej prostej, więc Jᵀe wynosi zero, choć e nie: transpozycja '
            'i sdls stoją w miejscu, a pinv nie znajduje skończonego kroku. '
            'Cofnij przegub 3 konfiguracji startowej o dziesięć stopni, do −97°, a wszystkie dojdą do celu.',
        },
        seed=STRETCHED,
        tip_at=STRETCHED,
        shift=INWARDS,
        methods=('transpose', 'pinv', 'sdls'),
    ),
    Lesson(
        'branch',
        'adaptive_dls',
        {'en': 'Another branch', 'pl': 'Inna gałąź'},
        {
            'en': 'The target is the pose of the notes, which the arm reaches in eight ways. '
            'From this seed every method ends with the elbow on the other side than the configuration of the notes. '
            'That is no error: an iterative solver ends at a solution near its seed.',
            'pl': 'Cel to poza z notatek, którą ramię osiąga na osiem sposobów. '
            'Z tej konfiguracji startowej każda metoda kończy z łokciem po innej stronie niż w notatkach. '
            'To nie błąd: solver iteracyjny kończy w rozwiązaniu bliskim konfiguracji startowej.',
        },
        seed=(7.8, 11.4, -176.4, 2.1, 80.0, 175.8),
        tip_at=NOTES_SEED,
    ),
    Lesson(
        'residual',
        'dls',
        {'en': 'The residual error of DLS', 'pl': 'Błąd resztkowy DLS'},
        {
            'en': 'With lambda 0.5 a step of dls leaves the share lambda²/(s² + lambda²) of the error along a '
            'direction. '
            'Directions with a small singular value s shrink by a few percent only, and 40 iterations are not enough. '
            'adaptive_dls lowers lambda with the error and arrives in ten.',
            'pl': 'Przy lambda 0,5 każdy krok dls zostawia część lambda²/(s² + lambda²) błędu w danym kierunku. '
            'Kierunki o małej wartości osobliwej s maleją tylko o kilka procent i 40 iteracji nie wystarcza. '
            'adaptive_dls zmniejsza lambdę razem z błędem i dochodzi w dziesięciu.',
        },
        methods=('pinv', 'dls', 'adaptive_dls'),
        parameters={'dls.damping': 0.5, 'max_iterations': 40},
    ),
    Lesson(
        'redundancy',
        'adaptive_dls',
        {'en': 'Redundancy and null space', 'pl': 'Redundancja i przestrzeń zerowa'},
        {
            'en': 'Seven joints serve six rows: the null space of J is a line, along which the joints move and the tip '
            'does not. '
            'The tip is at the target already, and null_space = posture turns the elbow towards a given posture. '
            'Step through the iterations: the bars of the joints change, the tip stays within millimetres.',
            'pl': 'Siedem przegubów obsługuje sześć wierszy: przestrzeń zerowa J jest prostą, wzdłuż której przeguby '
            'się poruszają, a końcówka nie. '
            'Końcówka jest już w celu, a null_space = posture obraca łokieć ku zadanej postawie. '
            'Przejdź przez iteracje: słupki przegubów się zmieniają, końcówka zostaje w granicach milimetrów.',
        },
        robot='panda',
        seed=(30.0, -30.0, -40.0, -120.0, -20.0, 100.0, 45.0),
        tip_at=(30.0, -30.0, -40.0, -120.0, -20.0, 100.0, 45.0),
        methods=('pinv', 'dls', 'adaptive_dls', 'sdls'),
        parameters={'null_space': 'posture', 'posture': [0.0, -0.5, 0.0, -2.1, 0.0, 1.7, 0.8]},
    ),
)


def lesson(name: str) -> Lesson:
    """Return the lesson of this name; raises KeyError if there is none."""
    return {item.name: item for item in LESSONS}[name]
