"""The controls for the node's parameters, and the node's values in them as they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import viser

from ros_ik_pkg.methods import DEFAULT, METHODS, TABLE, MethodOption
from ros_ik_pkg.panel.markup.texts import Texts
from ros_ik_pkg.ros.interface.parameters import PARAMETERS

SLIDERS = {  # lowest and highest value, and step
    'dls.damping': (0.0, 0.5, 0.005),
    'adaptive_dls.gain': (0.0, 1.0, 0.01),
    'sdls.max_step': (0.01, 3.14, 0.01),
}
FINEST = 0.001  # step of fields for numbers
TOLERANCES = tuple(f'1e-{k:02d}' for k in range(2, 9))
COMPARE = 'compare'


class ParameterControls:
    """The parameters tab; `changed` is called with the name and checked value of each change by the user."""

    def __init__(
        self,
        gui: viser.GuiApi,
        texts: Texts,
        on: Callable[[Any, Callable[[Any], object]], None],
        changed: Callable[[str, Any], object],
    ) -> None:
        self._gui, self._texts, self._on, self._changed = gui, texts, on, changed
        self._handles: dict[str, Any] = {}
        self._add('method', gui.add_dropdown(texts['node method'], METHODS, initial_value=DEFAULT))
        with gui.add_folder(texts['compared']):
            self._compared = {name: gui.add_checkbox(name, True) for name in METHODS}
        for box in self._compared.values():
            on(box, lambda _: self._change(COMPARE, self.compared))
        with gui.add_folder(texts['all methods']):
            self._add_tolerance('position_tolerance', texts['distance'], texts['distance hint'])
            self._add_tolerance('orientation_tolerance', texts['angle'], texts['angle hint'])
            self._add('max_iterations', gui.add_number(texts['iterations'], 2000, min=0, max=100000, step=1))
            self._add('step_size', gui.add_slider(texts['step size'], 0.05, 2.0, 0.05, 1.0))
        with gui.add_folder(texts['damping']):
            for method in TABLE:
                for option in method.options:
                    self._add_method_option(method.name, option)

    def _add_method_option(self, method: str, option: MethodOption) -> None:
        """Add a slider, or a field for the number if no range of it is the usual one."""
        name = f'{method}.{option.name}'
        label, value = self._texts.get(name, f'{method}, {option.name}'), option.default
        hint = option.text + (f' [{option.unit}]' if option.unit else '')
        if name in SLIDERS:
            low, high, step = SLIDERS[name]
            self._add(name, self._gui.add_slider(label, low, high, step, value, hint=hint))
        else:
            low, high = option.minimum, option.maximum
            self._add(name, self._gui.add_number(label, value, min=low, max=high, step=FINEST, hint=hint))

    def _add_tolerance(self, name: str, label: str, hint: str) -> None:
        self._add(name, self._gui.add_dropdown(label, TOLERANCES, initial_value=TOLERANCES[-3], hint=hint), float)

    def _add(self, name: str, handle: Any, read: Callable[[Any], Any] = lambda value: value) -> None:
        self._handles[name] = handle
        self._on(handle, lambda value: self._change(name, read(value)))

    def _change(self, name: str, value: Any) -> None:
        """Check a value and pass it on; raises OptionError, or ValueError if it is not a number."""
        self._changed(name, PARAMETERS[name].check(value))

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that have a control."""
        return (*self._handles, COMPARE)

    @property
    def compared(self) -> list[str]:
        """Return the methods that are switched on."""
        return [name for name, box in self._compared.items() if box.value]

    def show(self, values: Mapping[str, Any]) -> None:
        """Show values by name, as they are."""
        for name, value in values.items():
            if name == COMPARE:
                chosen = METHODS if 'all' in value else value
                for method, box in self._compared.items():
                    box.value = method in chosen
            elif name.endswith('_tolerance'):
                self._show_tolerance(self._handles[name], value)
            elif name in self._handles:
                _widen(self._handles[name], value)
                self._handles[name].value = value

    @staticmethod
    def _show_tolerance(handle: viser.GuiDropdownHandle[str], value: float) -> None:
        """Choose the value from the list; one that is not there is put there."""
        text = next((text for text in TOLERANCES if float(text) == value), f'{value!r}')
        handle.options = tuple(sorted({*TOLERANCES, text}, key=float, reverse=True))
        handle.value = text


def _widen(handle: Any, value: Any) -> None:
    """Widen the range of a slider so that a value of the node is on it, with all its digits."""
    if isinstance(handle, viser.GuiSliderHandle):
        handle.min, handle.max = min(handle.min, value), max(handle.max, value)
    if isinstance(value, float):
        digits = len(f'{value:.7f}'.rstrip('0').partition('.')[2])
        handle.precision = max(handle.precision, digits)
