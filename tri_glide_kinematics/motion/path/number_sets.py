"""Arrays of numbers as sets.

numpy's own functions for them load numpy.ma when they are called for the first time, and a control
cycle would wait 10 ms for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.vectors import FloatArray


def distinct(*parts: FloatArray) -> FloatArray:
    """Return all numbers that are in one of the ``parts`` in ascending order, each once.

    It is what np.unique returns.

    Args:
        parts: Shape (n,) each, not all of them empty.

    Returns:
        Shape (m,).
    """
    numbers = np.sort(np.concatenate(parts))
    return numbers[np.concatenate(((True,), numbers[1:] != numbers[:-1]))]


def are_among(numbers: FloatArray, others: FloatArray) -> NDArray[np.bool_]:
    """Return which of some ``numbers`` are also among ``others``, as np.isin does.

    Args:
        numbers: Shape (n,).
        others: ascending. Shape (m,).

    Returns:
        Shape (n,).
    """
    if not len(others):
        return np.zeros(len(numbers), dtype=bool)
    following = np.searchsorted(others, numbers)
    nearest = others[np.minimum(following, len(others) - 1)]
    return np.asarray(nearest == numbers)
