"""The Cholesky factors of scipy, without the rest of scipy.linalg."""

import subprocess
import sys

import numpy as np

from tri_glide_kinematics.motion.path_timing.interior_point import dpbtrf, dpbtrs

MOTION_ALONE = """
import sys
import tri_glide_kinematics.motion.engine.engine
from tri_glide_kinematics.motion.path_timing.interior_point import dpbtrf
assert "scipy.linalg" not in sys.modules
from scipy.linalg import cholesky_banded, lapack
assert lapack.dpbtrf is dpbtrf
cholesky_banded([[2.0, 2.0], [1.0, 0.0]], lower=True)
"""


def test_a_matrix_with_two_bands_beside_its_diagonal_is_solved():
    source = np.random.default_rng(0)
    bands = np.array([source.uniform(5.0, 6.0, 50), *source.uniform(-1.0, 1.0, (2, 50))])
    matrix = np.diag(bands[0])
    for offset in (1, 2):
        side = bands[offset, : 50 - offset]
        matrix += np.diag(side, offset) + np.diag(side, -offset)
    right = source.normal(size=50)
    factor, trouble = dpbtrf(bands, lower=1)
    assert not trouble
    solution, trouble = dpbtrs(factor, right, lower=1)
    assert not trouble
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-12)


def test_the_rest_of_scipy_is_not_waited_for_and_can_be_used():
    subprocess.run([sys.executable, "-c", MOTION_ALONE], check=True)
