"""Values of the drive at which a followed branch is sampled, and those at which it may close."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Values of the drive to report in the half-open interval (from, to], in this order.
Stations = Callable[[float, float], Array]

# Values of the drive closer than this are one: an arc meets its end to rounding only [rad].
SPLIT = 1e-12


def explicit_stations(values: Array) -> Stations:
    """Stations at the given ascending values."""

    def between(start: float, stop: float) -> Array:
        if stop > start:
            first, last = np.searchsorted(values, (start + SPLIT, stop + SPLIT), side="right")
            return values[first:last]
        first, last = np.searchsorted(values, (stop - SPLIT, start - SPLIT), side="left")
        return values[first:last][::-1]

    return between


def uniform_stations(offset: float, spacing: float) -> Stations:
    """Stations at ``offset`` and all multiples of ``spacing`` from there."""

    def between(start: float, stop: float) -> Array:
        low, high = sorted(((start - offset) / spacing, (stop - offset) / spacing))
        multiples = np.arange(math.floor(low), math.ceil(high) + 1, dtype=np.float64)
        values: Array = offset + spacing * multiples
        if stop > start:
            return values[(values > start + SPLIT) & (values <= stop + SPLIT)]
        return values[(values < start - SPLIT) & (values >= stop - SPLIT)][::-1]

    return between


def multiples(period: float, start: float, stop: float) -> list[float]:
    """Multiples of ``period`` in (start, stop], rising or falling; only 0 if it is infinite.

    One that is missed by rounding only belongs to the interval that ends there.
    """
    sign = 1.0 if stop > start else -1.0
    if math.isinf(period):
        candidates = [0.0]
    else:
        first, last = sorted((math.floor(start / period), math.ceil(stop / period)))
        candidates = [period * k for k in range(first - 1, last + 2)]
    inside = [s for s in candidates if sign * start + SPLIT < sign * s <= sign * stop + SPLIT]
    return sorted(inside, reverse=sign < 0.0)
