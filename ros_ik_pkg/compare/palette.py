"""Colours of the methods, the same everywhere: the Okabe-Ito palette, which is safe for colour-blind readers."""

from __future__ import annotations

COLOURS = {
    'transpose': '#e69f00',
    'pinv': '#cc79a7',
    'dls': '#0072b2',
    'adaptive_dls': '#009e73',
    'sdls': '#56b4e9',
}
# On a dark background, blue and green have too little contrast.
COLOURS_ON_DARK = {**COLOURS, 'dls': '#6c8cff', 'adaptive_dls': '#1fc79a', 'pinv': '#e08fc0'}
TARGET = '#d7261e'
GOOD, BAD = '#2b8a4b', '#d7261e'
GOOD_ON_DARK, BAD_ON_DARK = '#51cf7f', '#ff7b72'


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue (0 to 255) of '#rrggbb'."""
    red, green, blue = bytes.fromhex(colour.removeprefix('#'))
    return red, green, blue
