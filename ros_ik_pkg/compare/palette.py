"""Colours, the same in plots, messages and on the page; those of the methods are in the table of methods."""

from __future__ import annotations

from ros_ik_pkg.methods import TABLE

COLOURS = {method.name: method.look.colour for method in TABLE}
COLOURS_ON_DARK = {method.name: method.look.dark_colour for method in TABLE}
TARGET = '#d7261e'
GOOD, BAD = '#2b8a4b', '#d7261e'
GOOD_ON_DARK, BAD_ON_DARK = '#51cf7f', '#ff7b72'


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue (0 to 255) of '#rrggbb'."""
    red, green, blue = bytes.fromhex(colour.removeprefix('#'))
    return red, green, blue
