"""Types of points, vectors and arrays of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]
Vector3 = tuple[float, float, float]
FloatArray = NDArray[np.float64]
