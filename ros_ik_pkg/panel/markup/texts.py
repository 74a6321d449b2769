"""Every text of the page, in English and Polish."""

from __future__ import annotations

from ros_ik_pkg.compare.words import LANGUAGES
from ros_ik_pkg.ik import Status

LANGUAGE_NAMES = {'en': 'English', 'pl': 'Polski'}

_TEXTS = {
    'task': ('Task', 'Zadanie'),
    'parameters': ('Parameters', 'Parametry'),
    'motion tab': ('Motion', 'Ruch'),
    'lessons': ('Lessons', 'Lekcje'),
    'methods': ('Methods', 'Metody'),
    'iteration': ('Iteration', 'Iteracja'),
    'robot': ('Robot', 'Robot'),
    'open urdf': ('Open a URDF …', 'Otwórz URDF …'),
    'begin': ('Begin with', 'Zacznij od'),
    'singular': ('Singular', 'Osobliwe'),
    'far': ('Far', 'Daleko'),
    'Lecture notes': ('Lecture notes', 'Notatki'),
    'Random': ('Random', 'Losowo'),
    'Wrist singular': ('Wrist singular', 'Nadgarstek'),
    'Arm stretched out': ('Arm stretched out', 'Ramię proste'),
    'Behind the base': ('Behind the base', 'Za podstawą'),
    'Unreachable': ('Unreachable', 'Poza zasięgiem'),
    'target': ('Target', 'Cel'),
    'obstacles': ('Obstacles', 'Przeszkody'),
    'Box': ('Box', 'Pudło'),
    'Ball': ('Ball', 'Kula'),
    'Remove all': ('Remove all', 'Usuń wszystkie'),
    'contact': (
        'no solution: with the least penetration, {links} touch',
        'brak rozwiązania: przy najmniejszym wnikaniu stykają się {links}',
    ),
    'no shapes': (
        'This robot has no shapes for contact: obstacles do not count for it.',
        'Ten robot nie ma brył do wykrywania kolizji: przeszkody go nie dotyczą.',
    ),
    'seed': ('Seed', 'Konfiguracja startowa'),
    'tip': ('Tip of the solution', 'Końcówka w rozwiązaniu'),
    'dark': ('Dark page', 'Ciemna strona'),
    'language': ('Language', 'Język'),
    'node method': ('Node solves by', 'Metoda węzła'),
    'compared': ('Compared methods', 'Porównywane metody'),
    'all methods': ('All methods', 'Wszystkie metody'),
    'distance': ('Distance [m]', 'Odległość [m]'),
    'angle': ('Angle [rad]', 'Kąt [rad]'),
    'distance hint': ('largest error of the position', 'największy błąd pozycji'),
    'angle hint': ('largest error of the orientation', 'największy błąd orientacji'),
    'iterations': ('Iterations', 'Liczba iteracji'),
    'step size': ('Step size', 'Wielkość kroku'),
    'damping': ('Damping', 'Tłumienie'),
    'adaptive_dls.damping': ('adaptive, least', 'adaptacyjne, najmniejsze'),
    'adaptive_dls.gain': ('adaptive, gain', 'adaptacyjne, współczynnik'),
    'dls.damping': ('dls', 'dls'),
    'sdls.max_step': ('sdls, gamma_max', 'sdls, gamma_max'),
    'waiting': ('waiting for the node …', 'czekam na węzeł …'),
    'looking': ('looking for the node …', 'szukam węzła …'),
    'no node': ('no IK node {name}; waiting for it …', 'nie ma węzła IK {name}; czekam na niego …'),
    'solved': (
        'solved by {method} in {iterations} iterations{attempts}, {time} ms',
        'rozwiązane przez {method}, iteracji: {iterations}{attempts}, {time} ms',
    ),
    'attempts': (' and {count} attempts', ', prób: {count}'),
    'choose': ('Choose methods to compare.', 'Wybierz metody do porównania.'),
    'title': ('{count}, one target', '{count}, jeden cel'),
    'method': ('method', 'metoda'),
    'steps': ('steps', 'kroki'),
    'time': ('time [ms]', 'czas [ms]'),
    'status': ('status', 'stan'),
    'note': (
        'One descent each; the search of the node takes longer steps and restarts.',
        'Po jednym zejściu; węzeł szuka dłuższymi krokami i ponawia próby.',
    ),
    'plot position': ('Distance from the target [m]', 'Odległość od celu [m]'),
    'plot orientation': ('Angle from the target [rad]', 'Kąt od celu [rad]'),
    'end of curve': ('{method}: {error} after {count} iterations', '{method}: {error} po iteracjach: {count}'),
    'closest': ('closest approach, no solution', 'najbliższe podejście, brak rozwiązania'),
    'no solution': ('no solution for this target', 'brak rozwiązania dla tego celu'),
    'the seed': ('the seed', 'konfiguracja startowa'),
    'an iterate': ('iteration {k} of {method}', 'iteracja {k} metody {method}'),
    'refused by node': ('the node refused: {reason}', 'węzeł odmówił: {reason}'),
    'cannot show': (
        'cannot show the robot of the node: {error}. Choose another one here.',
        'nie da się pokazać robota węzła: {error}. Wybierz tu innego.',
    ),
    # The microscope
    'look into': ('Look into', 'Zajrzyj do'),
    'nothing': ('the solution', 'rozwiązania'),
    'search': ('search of the node', 'przeszukiwania węzła'),
    'back': ('◀ Back', '◀ Wstecz'),
    'play': ('Play ▶', 'Odtwórz ▶'),
    'pause': ('Pause ❙❙', 'Pauza ❙❙'),
    'next': ('Next ▶❙', 'Dalej ▶❙'),
    'choose descent': (
        'Choose a method above to walk through its iterations: the arm stands at each one, with its Jacobian, its '
        'error and its step.',
        'Wybierz wyżej metodę, aby przejść przez jej iteracje: ramię staje w każdej z nich, z jakobianem, błędem '
        'i krokiem.',
    ),
    'no descent': ('This method has not run on this target.', 'Ta metoda nie była uruchomiona dla tego celu.'),
    'stage fk': ('forward kinematics', 'kinematyka prosta'),
    'stage error': ('error', 'błąd'),
    'stage jacobian': ('Jacobian', 'jakobian'),
    'stage step': ('step', 'krok'),
    'stage update': ('update, stop test', 'aktualizacja, stop'),
    'tip at': ('tip at', 'końcówka w'),
    'largest step': ('largest joint step', 'największy krok przegubu'),
    'within': ('within tolerance: stop', 'w tolerancji: stop'),
    'go on': ('not within tolerance: k ← k + 1', 'poza tolerancją: k ← k + 1'),
    'last one': ('last iterate: stop', 'ostatnia iteracja: stop'),
    'attempt': ('attempt {k}', 'próba {k}'),
    'gain of direction': ('Gain of each method against the singular value', 'Wzmocnienie metod a wartość osobliwa'),
    'direction': ('direction', 'kierunek'),
    'component': ('error', 'błąd'),
    'motion': ('motion by each method [rad]', 'ruch według metod [rad]'),
    'joint steps': ('Step of each joint', 'Krok każdego przegubu'),
    'capped': ('capped', 'obcięty'),
    'held': ('at its limit', 'na ograniczeniu'),
    'arrows': (
        'Arrows at the tip: where it goes if only this joint moves (thin: its axis of rotation).',
        'Strzałki w końcówce: dokąd idzie, gdy porusza się tylko ten przegub (cienkie: oś obrotu).',
    ),
    # The path
    'path': ('Path', 'Ścieżka'),
    'way points': ('Poses', 'Pozy'),
    'add': ('Add', 'Dodaj'),
    'delete': ('Delete', 'Usuń'),
    'clear': ('Clear', 'Wyczyść'),
    'tool speed': ('Speed [m/s]', 'Prędkość [m/s]'),
    'speed hint': ('0: as fast as the joints allow', '0: tak szybko, jak pozwalają przeguby'),
    'branches': ('Branch changes', 'Zmiany gałęzi'),
    'branches hint': (
        'how often the joints may leave the path to go on in another branch',
        'ile razy przeguby mogą zejść ze ścieżki, aby kontynuować w innej gałęzi',
    ),
    'solve path': ('Solve the path', 'Rozwiąż ścieżkę'),
    'path hint': (
        'Add two poses or more; click one to choose it, drag its arrows.',
        'Dodaj co najmniej dwie pozy; kliknij pozę, aby ją wybrać, i przeciągnij jej strzałki.',
    ),
    'path ready': (
        'Drag the poses; then solve the path.', 'Przeciągnij pozy, a potem rozwiąż ścieżkę.',
    ),
    'path sent': (
        'The node solves the path; the first one on a machine takes up to half a minute.',
        'Węzeł rozwiązuje ścieżkę; pierwsza na danej maszynie zajmuje do pół minuty.',
    ),
    'path solved': (
        'Solved whole: {seconds} s, the joints travel {travel} rad or m.',
        'Rozwiązana w całości: {seconds} s, przeguby przebywają {travel} rad lub m.',
    ),
    'path reconfigured': (
        'The joints leave the path at pose {poses} to change the branch (purple).',
        'Przeguby schodzą ze ścieżki przy pozie {poses}, aby zmienić gałąź (fioletowe).',
    ),
    'path slowed': (
        'The joints cannot keep the tip speed everywhere.', 'Przeguby nie wszędzie utrzymują prędkość końcówki.',
    ),
    'path sigma': (
        'Nearest to singular at pose {pose}: sigma_min {sigma}.',
        'Najbliżej osobliwości przy pozie {pose}: sigma_min {sigma}.',
    ),
    'path reached': (
        'It goes as far as pose {pose} (red cube).', 'Prowadzi do pozy {pose} (czerwony sześcian).',
    ),
    'time in motion': ('Time [s]', 'Czas [s]'),
    'stop': ('Stop', 'Zatrzymaj'),
    'joints in time': ('Joints over time, between their limits', 'Przeguby w czasie, między ograniczeniami'),
    'strips note': (
        'Dashed: limits, and sigma_min below which the line is marked. Purple: off the path.',
        'Kreskowane: ograniczenia i sigma_min, poniżej którego linia jest oznaczona. Fioletowe: poza ścieżką.',
    ),
    'joint range': ('{name}: {span}, limits {low} and {high}', '{name}: {span}, ograniczenia {low} i {high}'),
    'joint range unlimited': ('{name}: {span}, no limits', '{name}: {span}, bez ograniczeń'),
    'sigma range': ('smallest singular value: {low} to {high}', 'najmniejsza wartość osobliwa: {low} do {high}'),
    'path at': ('{seconds} s: sigma_min {sigma}', '{seconds} s: sigma_min {sigma}'),
    'on the path': ('on the path, at {seconds} s', 'na ścieżce, {seconds} s'),
    # The stream of commands
    'drive': ('Drive', 'Prowadzenie'),
    'drive on': ('Drive by the gizmo', 'Prowadź strzałkami'),
    'drive hint': (
        'the tip follows the arrows at the target by twists while you hold them',
        'końcówka podąża za strzałkami celu, dopóki je trzymasz',
    ),
    'drive off': (
        'While this is on, drag the arrows at the target: the tip follows at most at these speeds, and stops when you '
        'let go. The node streams commands (command_rate).',
        'Gdy włączone, przeciągaj strzałki celu: końcówka podąża najwyżej z tymi prędkościami i staje, gdy puścisz. '
        'Węzeł wysyła strumień poleceń (command_rate).',
    ),
    'most speed': ('Most [m/s]', 'Najwyżej [m/s]'),
    'most turn': ('Most [rad/s]', 'Najwyżej [rad/s]'),
    'last command': ('the last command of the stream', 'ostatnie polecenie strumienia'),
    'velocity': ('Velocity', 'Prędkość'),
    'acceleration': ('Acceleration', 'Przyspieszenie'),
    'peak': ('at most {share} % of its limit: {name}', 'najwyżej {share} % ograniczenia: {name}'),
    # The reach
    'reach': ('Reach', 'Zasięg'),
    'map reach': ('Map the reach', 'Wyznacz zasięg'),
    'show reach': ('Show it', 'Pokaż'),
    'cut': ('Cut at y [m]', 'Przekrój y [m]'),
    'reach hint': (
        'The node maps what the arm reaches, in some ten seconds; the first time on a machine takes longer.',
        'Węzeł wyznacza zasięg ramienia w kilkanaście sekund; za pierwszym razem na maszynie trwa to dłużej.',
    ),
    'reach known': (
        '{count} positions, from red (0) to blue ({end}): {figure}. Click one: the arm goes there.',
        'Pozycji: {count}, od czerwonych (0) do niebieskich ({end}): {figure}. Kliknij: ramię tam pojedzie.',
    ),
    'reach at': (
        '{x:.2f} {y:.2f} {z:.2f} m: {share:.0f} % of the rotations, smallest singular value {sigma:.3f}',
        '{x:.2f} {y:.2f} {z:.2f} m: {share:.0f} % obrotów, najmniejsza wartość osobliwa {sigma:.3f}',
    ),
    'reach gap': ('clearance {gap:.3f} m', 'odstęp {gap:.3f} m'),
    'colour by': ('Colour by', 'Kolor według'),
    'share': ('share of the rotations', 'część obrotów'),
    'sigma_min': ('smallest singular value', 'najmniejsza wartość osobliwa'),
    'clearance': ('clearance', 'odstęp'),
    # Lessons
    'newton': ('Newton in one dimension', 'Newton w jednym wymiarze'),
    'newton text': (
        'x³ − 4x − 1 = 0: the tangent replaces the curve, its zero is the next guess. The correct digits double with '
        'each step; IK does the same with the Jacobian as slope.',
        'x³ − 4x − 1 = 0: styczna zastępuje krzywą, jej miejsce zerowe jest następnym przybliżeniem. Liczba dobrych '
        'cyfr podwaja się z każdym krokiem; IK robi to samo z jakobianem zamiast pochodnej.',
    ),
    'tangents': ('Tangents', 'Styczne'),
    'choose lesson': ('Choose a lesson.', 'Wybierz lekcję.'),
}
_COUNTS = {
    'en': ('No methods', 'One method', 'Two methods', 'Three methods', 'Four methods', 'Five methods'),
    'pl': ('Bez metod', 'Jedna metoda', 'Dwie metody', 'Trzy metody', 'Cztery metody', 'Pięć metod'),
}
_MANY = {'en': '{count} methods', 'pl': '{count} metod'}
_STATUSES = {
    'pl': {
        Status.CONVERGED.label: 'zbieżna',
        Status.MAX_ITERATIONS.label: 'limit kroków',
        Status.STALLED.label: 'utyka',
        Status.OSCILLATING.label: 'oscyluje',
        Status.DIVERGED.label: 'rozbieżna',
        Status.NOT_FINITE.label: 'krok nieskończony',
        Status.DEADLINE.label: 'brak czasu',
        Status.UNREACHABLE.label: 'poza zasięgiem',
        Status.JOINT_JUMP.label: 'za duży skok',
        Status.COLLISION.label: 'kolizja',
    },
    'en': {Status.MAX_ITERATIONS.label: 'out of steps'},  # the label is too long for the column
}
_OUTCOMES = {'failed': 'nierozwiązane', 'refused': 'odrzucone', 'partial': 'częściowo'}
_BREAKS = {
    'reach': 'żadne położenia przegubów nie sięgają pozy',
    'limit': 'pozy sięgają tylko położenia poza ograniczeniami przegubów',
    'singularity': 'ramię jest tam osobliwe',
    'branch': 'gałąź się kończy; inna prowadziłaby dalej',
    'velocity': 'przegub przekroczyłby ograniczenie prędkości',
    'contact': 'ramię dotknęłoby siebie albo otoczenia',
    'deadline': 'skończył się czas',
}
_REASONS = {
    Status.UNREACHABLE.label: 'cel jest poza zasięgiem: nie prowadzi do niego żadne położenie przegubów w granicach',
    Status.STALLED.label: 'błąd przestał maleć: minimum lokalne, ograniczenia przegubów albo cel poza zasięgiem',
    Status.MAX_ITERATIONS.label: 'wyczerpano iteracje, gdy błąd jeszcze malał',
    Status.OSCILLATING.label: 'błąd rośnie i maleje na przemian',
    Status.DIVERGED.label: 'błąd urósł: krok wyszedł poza obszar, w którym model liniowy jest dobry',
    Status.NOT_FINITE.label: 'krok nie był liczbą skończoną: jakobian jest osobliwy, a metoda nie ma tłumienia',
    Status.DEADLINE.label: 'skończył się czas',
    Status.JOINT_JUMP.label: 'rozwiązania istnieją, lecz każde leży dalej niż pozwala max_joint_jump',
    Status.COLLISION.label: 'każde rozwiązanie dotyka robota albo otoczenia',
    'joint_states': 'brak dobrych pozycji przegubów',
    'no_robot': 'nie ma jeszcze robota',
    'frame': 'nieznany układ współrzędnych',
    'quaternion': 'orientacja nie jest kwaternionem jednostkowym',
    'not_finite': 'poza celu nie jest skończona',
    'position': 'cel jest zbyt daleko',
    'stale': 'cel jest przestarzały',
    'future': 'czas celu leży w przyszłości',
    'argument': 'zły argument',
    'superseded': 'nowsze polecenie zajęło jego miejsce',
    'compiling': 'solver jest jeszcze kompilowany',
    'internal_error': 'błąd wewnętrzny',
}


class Texts:
    """Texts by key in the language of the page, which may change."""

    def __init__(self, language: str = LANGUAGES[0]) -> None:
        self.language = language

    def __getitem__(self, key: str) -> str:
        return _TEXTS[key][LANGUAGES.index(self.language)]

    def get(self, key: str, otherwise: str) -> str:
        """Return the text of a key, or another text if there is none."""
        return self[key] if key in _TEXTS else otherwise

    def fill(self, key: str, **values: object) -> str:
        """Return a text with its placeholders filled in."""
        return self[key].format(**values)

    def title(self, count: int) -> str:
        """Return the title of the page for this number of compared methods."""
        counts = _COUNTS[self.language]
        words = counts[count] if count < len(counts) else _MANY[self.language].format(count=count)
        return self.fill('title', count=words)

    def status(self, label: str) -> str:
        """Return the label of a status for the table."""
        return _STATUSES[self.language].get(label, label)

    def failure(self, outcome: str, status: str, message: str) -> str:
        """Say why a target has no solution; in English in the node's own words."""
        if self.language == 'en':
            return f'{outcome}: {message}'
        return f'{_OUTCOMES.get(outcome, outcome)}: {_REASONS.get(status, status)}'

    def path_failure(self, outcome: str, status: str, message: str) -> str:
        """Say why a path is not solved whole; in English in the node's own words."""
        if self.language == 'en':
            return f'{outcome}: {message}.'
        return f'{_OUTCOMES.get(outcome, outcome)}: {_BREAKS.get(status, _REASONS.get(status, status))}.'


def all_texts(language: str) -> set[str]:
    """Return the texts of the page that are not the same in every language, for one language."""
    index = LANGUAGES.index(language)
    return {texts[index] for texts in _TEXTS.values() if texts[0] != texts[1]} | set(_COUNTS[language])
