"""How many positions an F-mechanism has at a crank angle, counted in fractions without rounding."""

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction

from tri_glide_kinematics.mechanisms.f_mechanism import CrankPins, Linkage, pins_at

Polynomial = list[Fraction]
Vector = tuple[Fraction, Fraction]

_DEGREE = 6


def count_positions(linkage: Linkage, crank_angle: float) -> int:
    """Return the number of platform angles that close the mechanism (Sturm's theorem).

    The closure condition is evaluated as it is defined at seven places t = tan(angle / 2), which
    settle the sextic. The crank pins are those of ``pins_at``, with their rounding.
    """
    pins = pins_at(linkage, linkage.crank_angles(crank_angle))
    places = [Fraction(k) for k in range(-3, _DEGREE - 2)]
    sextic = _through(places, [_condition(linkage, pins, t) for t in places])
    chain = [_whole(sextic), _whole(_derivative(sextic))]
    while len(chain[-1]) > 1:
        rest = _whole(_remainder(chain[-2], chain[-1]))
        if not rest:
            break
        chain.append([-a for a in rest])
    below = [p[-1] * (-1) ** (len(p) - 1) for p in chain]
    above = [p[-1] for p in chain]
    at_half_a_turn = sextic[-1] == 0
    return _changes(below) - _changes(above) + at_half_a_turn


def _condition(linkage: Linkage, pins: CrankPins, t: Fraction) -> Fraction:
    """The closure condition times (1 + t^2)^3."""
    norm = 1 + t * t
    cosine, sine = (1 - t * t) / norm, 2 * t / norm
    l_a, l_b, l_c = map(Fraction, linkage.rods)
    ways = []
    for joint, pin in (
        (linkage.platform_b, pins.b - pins.a),
        (linkage.platform_c, pins.c - pins.a),
    ):
        (d_x, d_y), (e_x, e_y) = _vector(joint), _vector(pin)
        ways.append((cosine * d_x - sine * d_y - e_x, sine * d_x + cosine * d_y - e_y))
    (b_x, b_y), (c_x, c_y) = ways
    m_b = (l_b**2 - l_a**2 - b_x**2 - b_y**2) / 2
    m_c = (l_c**2 - l_a**2 - c_x**2 - c_y**2) / 2
    x, y = m_b * c_x - m_c * b_x, m_b * c_y - m_c * b_y
    return (x * x + y * y - (l_a * (b_x * c_y - b_y * c_x)) ** 2) * norm**3


def _vector(point: complex) -> Vector:
    return Fraction(point.real), Fraction(point.imag)


def _through(places: Sequence[Fraction], values: Sequence[Fraction]) -> Polynomial:
    """The polynomial through the values (Newton's divided differences), lowest power first."""
    c = list(values)
    for k in range(1, len(c)):
        for i in range(len(c) - 1, k - 1, -1):
            c[i] = (c[i] - c[i - 1]) / (places[i] - places[i - k])
    p = [c[-1]]
    for place, constant in zip(reversed(places[:-1]), reversed(c[:-1])):
        p = [a - place * b for a, b in zip([Fraction(0), *p], [*p, Fraction(0)])]
        p[0] += constant
    return p


def _derivative(p: Polynomial) -> Polynomial:
    return [power * a for power, a in enumerate(p)][1:]


def _whole(p: Polynomial) -> Polynomial:
    """The same polynomial times a positive number, without zeros in front and common factors."""
    p = list(p)
    while p and p[-1] == 0:
        p.pop()
    if not p:
        return p
    factor = Fraction(
        math.lcm(*(a.denominator for a in p)), math.gcd(*(a.numerator for a in p)) or 1
    )
    return [a * factor for a in p]


def _remainder(p: Polynomial, q: Polynomial) -> Polynomial:
    p = list(p)
    while len(p) >= len(q):
        quotient = p[-1] / q[-1]
        for i, a in enumerate(q):
            p[len(p) - len(q) + i] -= quotient * a
        p.pop()
    return p


def _changes(values: Sequence[Fraction]) -> int:
    """Changes of sign, zeros left out."""
    signs = [value > 0 for value in values if value]
    return sum(a != b for a, b in itertools.pairwise(signs))
