"""Numbers as texts for people write them."""

from __future__ import annotations

from collections.abc import Iterable

# A length so many times as large as what it is compared with, and so large [m], looks like one in
# millimetres.
LOOKS_LIKE_MILLIMETRES = 3.0

# Bounds in texts have so many significant digits, or less.
_DIGITS_OF_BOUNDS = 6

# Rounding errors leave this of a zero, as part of the numbers that it was computed from.
ROUNDING_ERROR = 1e-12


def number_text(value: float, digits: int = 9, scale: float = 1.0) -> str:
    """Return ``value`` as text: never ``-0``, and 0 if it is zero but for rounding.

    Args:
        value: any number, NaN and infinity too.
        digits: significant digits.
        scale: size of the numbers that it was computed from, in its unit: 1 suits lengths and
            velocities of machines in SI units; with 0 the smallest number is written as it is.
    """
    if abs(value) <= ROUNDING_ERROR * scale:
        value = 0.0
    return f"{value:.{digits}g}"


def refused_text(value: float) -> str:
    """Return a number beyond its bound as text that does not read like the bound.

    Bounds are mostly numbers of few digits: one that is such a number but for rounding is written
    with all its digits. However small it is: that may be what is wrong with it.
    """
    text = number_text(value, scale=0.0)
    looks_round = text == number_text(value, _DIGITS_OF_BOUNDS, 0.0)
    return str(value) if looks_round and float(text) != value else text


def vector_text(values: Iterable[float], digits: int = 9, scale: float = 1.0) -> str:
    """Return ``values`` in round brackets, each as in :func:`number_text`."""
    return "(" + ", ".join(number_text(value, digits, scale) for value in values) + ")"


def list_text(values: Iterable[float], decimals: int) -> str:
    """Return numbers as a list in YAML, with so many decimals; none is a negative zero."""
    return f"[{', '.join(f'{round(value, decimals) + 0.0:.{decimals}f}' for value in values)}]"


def unit_question(length: float, bound: float) -> str:
    """Return the end of a text about a length that is far beyond its bound: a question, or nothing.

    Args:
        length: that somebody gave [m].
        bound: what it is compared with [m].
    """
    if abs(length) > LOOKS_LIKE_MILLIMETRES * max(abs(bound), 1.0):
        return "; is it in millimetres?"
    return ""
