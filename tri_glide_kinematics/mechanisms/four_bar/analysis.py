"""The abilities of a four-bar linkage: Grashof class, crank limits, transmission, dead centres.

Crank angles here are measured from the ground line; letters are those of source 004: crank a,
coupler b, rocker c, ground d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

from tri_glide_kinematics.checks import SMALLEST, finite, positive
from tri_glide_kinematics.equal_numbers import wrapped
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.wording import number_text


class NotAssemblableError(KinematicsError):
    """Four links cannot be joined to a linkage that moves: one is too long for the others."""

    def __init__(self, link: str, length: float, rest: float) -> None:
        """Store the too long ``link``, its ``length`` and the ``rest`` of the links, in [m]."""
        super().__init__(
            f"{link} = {number_text(length, scale=0.0)} m must be shorter than the other three "
            f"links together, which are {number_text(rest, scale=0.0)} m"
        )
        self.link = link
        self.length = length
        self.rest = rest


# The loop is closed with the longest link as unit: lengths may be larger than other numbers [m].
LARGEST = 1e152

LINK_NAMES = ("crank", "coupler", "rocker", "ground")


@dataclass(frozen=True)
class LinkLengths:
    """Lengths of the four links of a linkage that can be assembled and moved.

    Attributes:
        crank: crank pivot to crank pin, in [m].
        coupler: crank pin to rocker pin, in [m].
        rocker: rocker pivot to rocker pin, in [m].
        ground: crank pivot to rocker pivot, in [m].
        tolerance: sums of two lengths that differ by no more than this part of the longest link
            count as equal, which makes the linkage a change-point linkage. From 0 to 1e-3.
    """

    crank: float
    coupler: float
    rocker: float
    ground: float
    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        """Check the lengths.

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a length is not positive, or is zero within the tolerance or
                rounding, or above ``LARGEST``, or the tolerance is not in its bounds.
            NotAssemblableError: if the longest link is as long as the other three together.
        """
        for name in LINK_NAMES:
            object.__setattr__(self, name, positive(name, getattr(self, name), "m", LARGEST))
        if not 0.0 <= finite("tolerance", self.tolerance) <= 1e-3:
            raise OutOfBoundsError("tolerance", self.tolerance, "from 0 to 1e-3")
        # A smaller part of the longest link has lost digits, or is zero.
        part = max(4.0 * self.tolerance, SMALLEST)
        least = part * self.longest
        for name in LINK_NAMES:
            if getattr(self, name) < least:
                what = "4 times the tolerance" if part > SMALLEST else f"{SMALLEST:.3g}"
                bound = f"at least {what} of the longest link, {least:.9g}"
                raise OutOfBoundsError(name, getattr(self, name), bound, "m")
        longest = max(LINK_NAMES, key=lambda name: float(getattr(self, name)))
        rest = sum(getattr(self, name) for name in LINK_NAMES if name != longest)
        if rest - self.longest <= self.tolerance * self.longest:
            raise NotAssemblableError(longest, self.longest, rest)

    @cached_property
    def longest(self) -> float:
        """Length of the longest link, in [m]."""
        return max(self.crank, self.coupler, self.rocker, self.ground)

    @cached_property
    def stretches(self) -> bool:
        """Whether coupler and rocker are just stretched when the crank points away from the ground.

        This is the change point at half a turn: crank + ground = coupler + rocker.
        """
        difference = self.coupler + self.rocker - self.crank - self.ground
        return abs(difference) <= self.tolerance * self.longest

    @cached_property
    def folds(self) -> bool:
        """Whether coupler and rocker just lie on each other when the crank lies on the ground.

        This is the change point at zero: abs(crank - ground) = abs(coupler - rocker).
        """
        difference = abs(self.coupler - self.rocker) - abs(self.crank - self.ground)
        return abs(difference) <= self.tolerance * self.longest

    @property
    def has_change_point(self) -> bool:
        """Whether all four joints come to lie on one line."""
        return self.stretches or self.folds

    @cached_property
    def scaled(self) -> tuple[float, float, float, float]:
        """Crank, coupler, rocker, ground over the longest link, with their change points exact.

        A linkage passes a change point smoothly only if its joints come to lie on one line exactly,
        which rounded lengths miss. So coupler and rocker (and the ground, if it equals the crank)
        give way by at most the tolerance.
        """
        a, b, c, d = (float(getattr(self, name)) / self.longest for name in LINK_NAMES)
        if self.folds and abs(a - d) <= self.tolerance:
            d = a
        total = a + d if self.stretches else b + c
        difference = math.copysign(abs(a - d), b - c) if self.folds else b - c
        if self.has_change_point:
            b, c = 0.5 * (total + difference), 0.5 * (total - difference)
        return a, b, c, d

    @cached_property
    def stretched_gap(self) -> float:
        """(coupler + rocker)^2 - (crank + ground)^2, the longest link being 1.

        Negative if the crank cannot point away from the rocker pivot; zero at a change point.
        """
        a, b, c, d = self.scaled
        return 0.0 if self.stretches else (b + c - a - d) * (a + b + c + d)

    @cached_property
    def folded_gap(self) -> float:
        """(crank - ground)^2 - (coupler - rocker)^2, the longest link being 1.

        Negative if the crank cannot point to the rocker pivot; zero at a change point.
        """
        a, b, c, d = self.scaled
        return 0.0 if self.folds else (d - a + b - c) * (d - a - b + c)


class Branch(Enum):
    """The two assemblies of the linkage at a crank angle.

    On the open branch the coupler points to the left of the diagonal from crank pin to rocker
    pivot, on the crossed branch to its right. At a change point the branches swap sides, as the
    linkage does when it moves on smoothly: a parallelogram is open, and its antiparallelogram
    crossed, all the way round. Left and right are as said for crank angles from 0 to half a turn,
    counted from the ground line.
    """

    OPEN = "open"
    CROSSED = "crossed"


class GrashofClass(Enum):
    """Which links of the linkage can turn fully."""

    CRANK_ROCKER = "crank-rocker"
    """The crank is the shortest link: it turns fully, the rocker swings."""
    ROCKER_CRANK = "rocker-crank"
    """The rocker is the shortest link: it turns fully, the crank swings."""
    DOUBLE_CRANK = "double crank"
    """The ground is the shortest link: crank and rocker both turn fully."""
    DOUBLE_ROCKER = "double rocker"
    """The coupler is the shortest link: it turns fully, crank and rocker swing."""
    TRIPLE_ROCKER = "triple rocker"
    """Shortest and longest link are longer than the other two: no link turns fully."""
    PARALLELOGRAM = "parallelogram"
    """Change points: crank equals rocker, and coupler equals ground."""
    KITE = "kite"
    """Change points: two pairs of equal links beside each other."""
    RHOMBUS = "rhombus"
    """Change points: all links are equal."""
    CHANGE_POINT = "change point"
    """Change point: shortest and longest link are as long as the other two, no two links pair."""


class DeadCentreKind(Enum):
    """Which two links are in line."""

    CRANK_COUPLER_STRETCHED = "crank and coupler stretched"
    """The rocker is at an end of its swing and cannot drive the crank."""
    CRANK_COUPLER_FOLDED = "crank and coupler folded"
    """The rocker is at the other end of its swing and cannot drive the crank."""
    COUPLER_ROCKER_STRETCHED = "coupler and rocker stretched"
    """The crank is at a limit, or at a change point, and cannot drive the rocker."""
    COUPLER_ROCKER_FOLDED = "coupler and rocker folded"
    """The crank is at a limit, or at a change point, and cannot drive the rocker."""


@dataclass(frozen=True)
class DeadCentre:
    """A position in which two moving links are in line.

    Attributes:
        kind: which links.
        crank_angle: in [rad], in (-pi, pi].
        rocker_angle: in [rad], in (-pi, pi]; NaN in the one position of a kite in which the crank
            pin lies on the rocker pivot, so that the rocker is free to turn.
        branch: the branch it lies on, None where both branches meet.
    """

    kind: DeadCentreKind
    crank_angle: float
    rocker_angle: float
    branch: Branch | None

    def turned(self, angle: float) -> DeadCentre:
        """Return the same position, with angles from a line that lies ``angle`` [rad] back."""
        return replace(
            self,
            crank_angle=wrapped(self.crank_angle + angle),
            rocker_angle=wrapped(self.rocker_angle + angle),
        )


@dataclass(frozen=True)
class TransmissionExtremes:
    """The bounds of the transmission angle over all crank angles, the same on both branches.

    Attributes:
        smallest: in [rad], from 0 to pi.
        smallest_at: crank angle at which it is met, in [rad].
        largest: in [rad], from 0 to pi.
        largest_at: crank angle at which it is met, in [rad].
    """

    smallest: float
    smallest_at: float
    largest: float
    largest_at: float

    @property
    def worst(self) -> float:
        """The transmission angle that is farthest from a right angle, as an acute one, in [rad]."""
        return min(self.smallest, math.pi - self.largest)


def grashof_class(lengths: LinkLengths) -> GrashofClass:
    """Classify a linkage by Grashof's rule, change points by the tolerance of ``lengths``."""
    a, b, c, d = (getattr(lengths, name) for name in LINK_NAMES)
    if lengths.has_change_point:
        tolerance = lengths.tolerance * lengths.longest

        def pair(first: float, second: float) -> bool:
            return abs(first - second) <= tolerance

        opposite = pair(a, c) and pair(b, d)
        adjacent = (pair(a, b) and pair(c, d)) or (pair(a, d) and pair(b, c))
        if opposite and adjacent:
            return GrashofClass.RHOMBUS
        if opposite:
            return GrashofClass.PARALLELOGRAM
        return GrashofClass.KITE if adjacent else GrashofClass.CHANGE_POINT
    shortest, second, third, longest = sorted((a, b, c, d))
    if shortest + longest > second + third:
        return GrashofClass.TRIPLE_ROCKER
    return {
        a: GrashofClass.CRANK_ROCKER,
        b: GrashofClass.DOUBLE_ROCKER,
        c: GrashofClass.ROCKER_CRANK,
        d: GrashofClass.DOUBLE_CRANK,
    }[shortest]


def outer_limit(lengths: LinkLengths) -> float:
    """Crank angle that stretches coupler and rocker, pi if the crank gets past; in [rad]."""
    if lengths.stretched_gap >= 0.0:
        return math.pi
    a, b, c, d = lengths.scaled
    rest = (b + c - d + a) * (b + c + d - a)
    return 2.0 * math.atan2(math.sqrt(rest), math.sqrt(-lengths.stretched_gap))


def inner_limit(lengths: LinkLengths) -> float:
    """Crank angle that folds coupler and rocker, 0 if the crank gets past; in [rad]."""
    if lengths.folded_gap >= 0.0:
        return 0.0
    a, b, c, d = lengths.scaled
    rest = (a + d - b + c) * (a + d + b - c)
    return 2.0 * math.atan2(math.sqrt(-lengths.folded_gap), math.sqrt(rest))


def crank_ranges(lengths: LinkLengths) -> tuple[tuple[float, float], ...]:
    """Intervals of crank angles at which the linkage can be closed, in [rad].

    One interval of a full turn from -pi to pi, one shorter interval, or two that mirror each other.
    """
    inner, outer = inner_limit(lengths), outer_limit(lengths)
    if lengths.folded_gap >= 0.0:
        return ((-outer, outer),)
    if lengths.stretched_gap >= 0.0:
        return ((inner, math.tau - inner),)
    return ((inner, outer), (-outer, -inner))


def transmission_extremes(lengths: LinkLengths) -> TransmissionExtremes:
    """Extremes of the angle between coupler and rocker: they lie where the diagonal has its own."""
    a, b, c, d = lengths.scaled

    def transmission_angle(diagonal: float) -> float:
        to_stretched = (b + c - diagonal) * (b + c + diagonal)
        to_folded = (diagonal - abs(b - c)) * (diagonal + abs(b - c))
        return math.atan2(math.sqrt(to_stretched * to_folded), b * b + c * c - diagonal * diagonal)

    return TransmissionExtremes(
        smallest=transmission_angle(max(abs(d - a), abs(b - c))),
        smallest_at=inner_limit(lengths),
        largest=transmission_angle(min(a + d, b + c)),
        largest_at=outer_limit(lengths),
    )


def branch_of(lengths: LinkLengths, crank_angle: float, side: float) -> Branch | None:
    """Branch of a position, None if the rocker pin is on the diagonal.

    Args:
        lengths: the linkage.
        crank_angle: in [rad].
        side: cross product of the diagonal with the coupler over the square of the longest link.
    """
    if abs(side) <= max(lengths.tolerance, 1e-14):
        return None
    if lengths.stretches:
        side *= math.cos(0.5 * crank_angle)
    if lengths.folds:
        side *= math.sin(0.5 * crank_angle)
    return Branch.OPEN if side > 0.0 else Branch.CROSSED


def dead_centres(lengths: LinkLengths) -> tuple[DeadCentre, ...]:
    """All positions in which two moving links are in line, each once, sorted by kind and angle."""
    return (
        *_crank_and_coupler(lengths, DeadCentreKind.CRANK_COUPLER_STRETCHED, 1.0),
        *_crank_and_coupler(lengths, DeadCentreKind.CRANK_COUPLER_FOLDED, -1.0),
        *_coupler_and_rocker(lengths, DeadCentreKind.COUPLER_ROCKER_STRETCHED),
        *_coupler_and_rocker(lengths, DeadCentreKind.COUPLER_ROCKER_FOLDED),
    )


def _both_signs(angle: float) -> tuple[float, ...]:
    """The angle and its mirror image, or one of them if they are the same direction."""
    return (angle,) if angle in (0.0, math.pi) else (-angle, angle)


def _crank_and_coupler(
    lengths: LinkLengths, kind: DeadCentreKind, sense: float
) -> list[DeadCentre]:
    """Dead centres in which the coupler continues the crank (``sense`` 1) or returns on it (-1)."""
    a, b, c, d = lengths.scaled
    reach = a + sense * b
    r = abs(reach)
    # Triangle of ground, rocker and r: the half angle between ground and r, by its tangent.
    opposite = (c - d + r) * (c + d - r)
    adjacent = (d + r - c) * (d + r + c)
    opposite = 0.0 if lengths.has_change_point and abs(opposite) <= 1e-14 else opposite
    adjacent = 0.0 if lengths.has_change_point and abs(adjacent) <= 1e-14 else adjacent
    if opposite < 0.0 or adjacent < 0.0 or r <= lengths.tolerance:
        return []
    direction = 2.0 * math.atan2(math.sqrt(opposite), math.sqrt(adjacent))
    found = []
    for angle in _both_signs(direction):
        crank_angle = angle if reach > 0.0 else wrapped(angle + math.pi)
        side = sense * b * d * math.sin(crank_angle)
        rocker_angle = wrapped(math.atan2(r * math.sin(angle), r * math.cos(angle) - d))
        found.append(
            DeadCentre(kind, crank_angle, rocker_angle, branch_of(lengths, crank_angle, side))
        )
    return sorted(found, key=lambda centre: centre.crank_angle)


def _coupler_and_rocker(lengths: LinkLengths, kind: DeadCentreKind) -> list[DeadCentre]:
    """Dead centres at the crank's limits of one kind, and at its change point."""
    a, b, c, d = lengths.scaled
    if kind is DeadCentreKind.COUPLER_ROCKER_STRETCHED:
        gap, limit, sense = lengths.stretched_gap, outer_limit(lengths), -1.0
    else:
        gap, limit, sense = lengths.folded_gap, inner_limit(lengths), math.copysign(1.0, b - c)
    if gap > 0.0:
        return []
    if limit == 0.0 and a == d:
        return [DeadCentre(kind, 0.0, math.nan, None)]
    found = []
    for crank_angle in _both_signs(limit):
        x = sense * (d - a * math.cos(crank_angle))
        y = -sense * a * math.sin(crank_angle)
        found.append(DeadCentre(kind, crank_angle, wrapped(math.atan2(y, x)), None))
    return found
