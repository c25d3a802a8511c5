"""Platform angles of an F-mechanism as roots of a sextic, one ``numpy.roots`` per crank angle."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism import CrankPins, Linkage, pins_at
from tri_glide_kinematics.vectors import FloatArray

DEGREE = 3  # of the condition, as a trigonometric polynomial of the platform angle
REAL = 1e-6  # largest imaginary part of a root that counts as real


def sextics(linkage: Linkage, crank_angles: Iterable[float]) -> FloatArray:
    """Return the sextics of t = tan(angle / 2), highest power first.

    The condition is evaluated at seven platform angles, which settle its coefficients.

    Args:
        linkage: dimensions of the mechanism.
        crank_angles: n of them [rad].

    Returns:
        Shape (n, 7).
    """
    samples = 2 * DEGREE + 1
    z = np.exp(2j * np.pi * np.arange(samples) / samples)
    one, other = np.poly1d([1j, 1.0]), np.poly1d([-1j, 1.0])
    orders = range(-DEGREE, DEGREE + 1)
    powers = np.array([(one ** (DEGREE + k) * other ** (DEGREE - k)).coeffs for k in orders])
    rows = []
    for angle in crank_angles:
        values = _condition(pins_at(linkage, linkage.crank_angles(angle)), linkage, z)
        coefficients = np.fft.fftshift(np.fft.fft(values)) / samples
        rows.append((coefficients @ powers).real)
    return np.array(rows)


def roots_in_a_loop(polynomials: FloatArray) -> list[NDArray[np.inexact]]:
    """Return the complex roots of each polynomial, as they come."""
    return [np.roots(polynomial) for polynomial in polynomials]


def real_angles(roots: NDArray[np.inexact]) -> FloatArray:
    """Return the platform angles that belong to the real roots, ascending."""
    real = roots[np.abs(roots.imag) < REAL].real
    return np.sort(2.0 * np.arctan(real))


def _condition(pins: CrankPins, linkage: Linkage, z: NDArray[np.complex128]) -> FloatArray:
    """Eliminate the rod vector from the three rod equations.

    The differences of the equations are linear in it; inserted into the first, they give this.
    """
    rods, joints = linkage.rods, linkage.joints
    w_b = z * (joints[1] - joints[0]) - (pins.b - pins.a)
    w_c = z * (joints[2] - joints[0]) - (pins.c - pins.a)
    m_b = 0.5 * (rods[1] ** 2 - rods[0] ** 2 - abs(w_b) ** 2)
    m_c = 0.5 * (rods[2] ** 2 - rods[0] ** 2 - abs(w_c) ** 2)
    determinant = (w_b.conjugate() * w_c).imag
    condition: FloatArray = abs(m_b * w_c - m_c * w_b) ** 2 - (rods[0] * determinant) ** 2
    return condition
