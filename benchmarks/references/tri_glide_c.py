"""The C loops of ``tri_glide.c``, compiled with ``-O2`` when they are first needed."""

import ctypes
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray

SOURCE = Path(__file__).with_name("tri_glide.c")


@cache
def library() -> ctypes.CDLL:
    """Compile and load the loops.

    Raises:
        FileNotFoundError: if there is no C compiler.
        subprocess.CalledProcessError: if it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder, "tri_glide.so")
        command = ["cc", "-O2", "-shared", "-fPIC", "-o", str(target), str(SOURCE), "-lm"]
        subprocess.run(command, check=True, capture_output=True)
        return ctypes.CDLL(str(target))


def inverse_batch_of(geometry: TriGlideGeometry) -> Callable[[FloatArray], FloatArray]:
    """Return the function from positions to heights, both of shape (n, 3) [m]."""
    return _batch("inverse", geometry)


def forward_batch_of(geometry: TriGlideGeometry) -> Callable[[FloatArray], FloatArray]:
    """Return the function from heights to positions, both of shape (n, 3) [m]."""
    return _batch("forward", geometry)


def _batch(name: str, geometry: TriGlideGeometry) -> Callable[[FloatArray], FloatArray]:
    loop = library()[name]
    loop.restype = None
    loop.argtypes = [ctypes.c_size_t] + [ctypes.c_void_p] * 3
    arms = zip(geometry.anchors, geometry.arm_lengths)
    constants = np.array([(*anchor, length * length) for anchor, length in arms])

    def batch(given: FloatArray) -> FloatArray:
        result = np.empty_like(given)
        loop(len(given), constants.ctypes.data, given.ctypes.data, result.ctypes.data)
        return result

    return batch
