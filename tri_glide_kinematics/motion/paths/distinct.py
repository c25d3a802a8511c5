"""Numbers out of several arrays, each once."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.vectors import FloatArray


def distinct(*parts: FloatArray) -> FloatArray:
    """Return all numbers that are in one of the ``parts`` in ascending order, each once.

    It is what np.unique returns. That loads numpy.ma when it is called for the first time, and a
    control cycle would wait 10 ms for it.

    Args:
        parts: Shape (n,) each, not all of them empty.

    Returns:
        Shape (m,).
    """
    numbers = np.sort(np.concatenate(parts))
    return numbers[np.concatenate(((True,), numbers[1:] != numbers[:-1]))]
