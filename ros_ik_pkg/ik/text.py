"""Texts for people: lists of names, suggestions for misspelt ones, numbers as people write them."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable


def suggest(name: str, known: Iterable[str]) -> str:
    """Return the known names that are similar to an unknown one."""
    known = list(known)
    return did_you_mean(name, known) or f'known: {list_names(known)}'


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the question whether a similar name was meant; empty if there is none."""
    close = difflib.get_close_matches(name, list(known), n=3, cutoff=0.5)
    return f'did you mean {list_names(close)}?' if close else ''


def to_number(text: str) -> float:
    """Return the finite number that a text holds, or NaN; unlike in Python, 1_0 is not a number."""
    try:
        value = math.nan if '_' in text else float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def list_names(names: Iterable[str], most: int = 12) -> str:
    """Write names as a list that fits into a message."""
    names = list(names)
    return ', '.join(names[:most]) + (f', ... ({len(names)} in all)' if len(names) > most else '')


def shorten(text: str, limit: int = 300) -> str:
    """Shorten a text from outside so that it cannot fill a log or a message."""
    return text if len(text) <= limit else f'{text[:limit]}... ({len(text)} characters)'
