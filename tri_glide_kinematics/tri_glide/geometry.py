"""Geometry of a tri-glide."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import (
    array_of_shape,
    finite,
    finite_vector,
    non_negative,
    positive,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.wording import number_text, vector_text


class GeometryError(KinematicsError):
    """Lengths and places from which no working tri-glide can be built."""


class CoincidentAnchorsError(GeometryError):
    """Two anchors lie at the same place, so that two arms do the work of one."""

    def __init__(self, arms: tuple[int, int], place: Sequence[float], distance: float) -> None:
        """Store the indices of both ``arms``, the ``place`` [m] and the ``distance`` [m]."""
        super().__init__(
            f"anchors of arms {arms[0] + 1} and {arms[1] + 1} coincide at "
            f"{vector_text(place)} m, {number_text(distance, 3)} m apart"
        )
        self.arms = arms
        self.place = tuple(place)
        self.distance = distance


class CollinearAnchorsError(GeometryError):
    """The anchors lie on one line, so that nothing holds the platform across it."""

    def __init__(self, anchors: Sequence[Sequence[float]], height: float) -> None:
        """Store the ``anchors`` [m] and the least ``height`` of their triangle [m]."""
        places = ", ".join(map(vector_text, anchors))
        super().__init__(
            f"anchors {places} m lie on one line: their triangle is {number_text(height, 3)} m high"
        )
        self.anchors = tuple(tuple(anchor) for anchor in anchors)
        self.height = height


class ArmsNeverMeetError(GeometryError):
    """The arms are too short for their anchors: no place lies within reach of all three."""

    def __init__(self, anchors: Sequence[Sequence[float]], arm_lengths: Sequence[float]) -> None:
        """Store the ``anchors`` [m] and the ``arm_lengths`` [m]."""
        places = ", ".join(map(vector_text, anchors))
        lengths = ", ".join(map(number_text, arm_lengths))
        super().__init__(
            f"arms of {lengths} m at anchors {places} m never meet: no place is within reach of all"
        )
        self.anchors = tuple(tuple(anchor) for anchor in anchors)
        self.arm_lengths = tuple(arm_lengths)


Point2 = tuple[float, float]

# Lengths whose ratio is below this are the same to any measurement of a machine; kinematics on
# such a geometry would return rounding errors.
RELATIVE_RESOLUTION = 1e-9


@dataclass(frozen=True, init=False)
class TriGlideGeometry:
    """Three towers and three arms, each with its own place and length.

    The platform never rotates, so each arm can be moved by the constant offset between the platform
    centre and its platform joint: all three then start from the platform centre, and arm i ends
    on the vertical line through its *anchor*, the horizontal place of tower joint i minus that of
    platform joint i.

    Attributes:
        anchors: horizontal place of each anchor. Shape (3, 2) [m].
        arm_lengths: distance of the two joints of each arm. Shape (3,) [m].
    """

    anchors: tuple[Point2, Point2, Point2]
    arm_lengths: tuple[float, float, float]

    def __init__(self, anchors: ArrayLike, arm_lengths: ArrayLike) -> None:
        """Check and store the geometry.

        Args:
            anchors: tower joint minus platform joint, horizontally. Shape (3, 2) [m].
            arm_lengths: Shape (3,) [m].

        Raises:
            WrongShapeError: if one of the arrays has another shape.
            NotFiniteError: if one of the numbers is NaN or infinite.
            OutOfBoundsError: if an arm length is not greater than zero.
            CoincidentAnchorsError: if two anchors lie at the same place.
            CollinearAnchorsError: if the three anchors lie on one straight line.
            ArmsNeverMeetError: if the arms are too short to reach any common point.
        """
        rows = array_of_shape("anchors", anchors, (3, 2)).tolist()
        points = tuple(finite_vector(f"anchors[{i}]", row, 2) for i, row in enumerate(rows))
        lengths = tuple(
            positive(f"arm_lengths[{i}]", length, "m")
            for i, length in enumerate(array_of_shape("arm_lengths", arm_lengths, (3,)).tolist())
        )
        _check_triangle(points, max(lengths))
        if not _discs_overlap(points, lengths):
            raise ArmsNeverMeetError(points, lengths)
        object.__setattr__(self, "anchors", points)
        object.__setattr__(self, "arm_lengths", lengths)

    @classmethod
    def symmetric(
        cls,
        base_radius: float,
        platform_radius: float,
        arm_length: float,
        orientation: float = 0.0,
    ) -> TriGlideGeometry:
        r"""Return the machine of threefold symmetry (source 000, section 3.2).

        With r the ``base_radius``, R the ``platform_radius`` and $\beta$ the ``orientation`` the
        anchors are $((R-r)\sin\beta, (r-R)\cos\beta)$,
        $((R-r)\cos(30°+\beta), (R-r)\sin(30°+\beta))$ and
        $((r-R)\cos(30°-\beta), (R-r)\sin(30°-\beta))$.

        Args:
            base_radius: radius of the circle through the tower joints [m].
            platform_radius: radius of the circle through the platform joints [m].
            arm_length: length of each arm [m].
            orientation: angle of the first tower, counter-clockwise from the y axis [rad].

        Raises:
            NotFiniteError: if one of the numbers is NaN or infinite.
            OutOfBoundsError: if a radius is negative or the arm length is not positive.
            CoincidentAnchorsError: if both radii are equal.
            ArmsNeverMeetError: if the arms are not longer than the difference of the radii.
        """
        base = non_negative("base_radius", base_radius, "m")
        platform = non_negative("platform_radius", platform_radius, "m")
        length = positive("arm_length", arm_length, "m")
        beta = finite("orientation", orientation)
        r = base - platform
        plus = math.radians(30.0) + beta
        minus = math.radians(30.0) - beta
        return cls(
            (
                (-r * math.sin(beta), r * math.cos(beta)),
                (-r * math.cos(plus), -r * math.sin(plus)),
                (r * math.cos(minus), -r * math.sin(minus)),
            ),
            (length, length, length),
        )

    @property
    def doubled_area(self) -> float:
        """Twice the area of the anchor triangle, positive if counter-clockwise [m^2]."""
        (x1, y1), (x2, y2), (x3, y3) = self.anchors
        return (x2 - x1) * (y3 - y1) - (y2 - y1) * (x3 - x1)

    @property
    def handedness(self) -> float:
        """1 if the anchors stand counter-clockwise, else -1: the sign of the Jacobian."""
        return math.copysign(1.0, self.doubled_area)

    def has_single_assembly_mode(self) -> bool:
        r"""Return whether a pose within reach of all arms is always below the carriages' plane.

        True is proven, False means only that it has to be checked for each pose. In a pose in the
        plane of the carriages the three arms lie in one half-plane, and the middle one sees the
        other two carriages under an obtuse angle if the arms are equally long; arms that differ
        by at most $\delta$ about their mean length $L$ change that product of the two sides by
        less than $4\delta L + \delta^2$ (docs/kinematics.md, section 5). So the anchor triangle
        has to be acute by more than this.
        """
        longest, shortest = max(self.arm_lengths), min(self.arm_lengths)
        spread = longest - shortest
        bound = 2.0 * spread * (longest + shortest) + spread * spread
        for corner in range(3):
            (x, y), (x1, y1), (x2, y2) = (self.anchors[(corner + k) % 3] for k in range(3))
            product = (x1 - x) * (x2 - x) + (y1 - y) * (y2 - y)
            # A right angle is one on every processor, and whichever way the machine stands.
            if product <= bound + RELATIVE_RESOLUTION * longest * longest:
                return False
        return True


def _check_triangle(anchors: Sequence[Sequence[float]], longest_arm: float) -> None:
    """Raise an error unless the anchors span a triangle worth the name."""
    sides = []
    for i, j in combinations(range(3), 2):
        distance = math.dist(anchors[i], anchors[j])
        if distance <= RELATIVE_RESOLUTION * longest_arm:
            raise CoincidentAnchorsError((i, j), anchors[i], distance)
        sides.append(distance)
    (x1, y1), (x2, y2), (x3, y3) = anchors
    doubled_area = abs((x2 - x1) * (y3 - y1) - (y2 - y1) * (x3 - x1))
    longest = max(sides)
    if doubled_area <= RELATIVE_RESOLUTION * longest * max(longest, longest_arm):
        raise CollinearAnchorsError(anchors, doubled_area / longest)


def _discs_overlap(anchors: Sequence[Sequence[float]], radii: Sequence[float]) -> bool:
    """Return whether the open discs of these ``radii`` around the ``anchors`` share an area.

    If they do, the common area is either a whole disc, and holds its centre, or it has corners,
    and these are crossings of two circles. The discs are shrunk a little, so that one common point
    alone does not count.
    """
    shrunk = [radius * (1.0 - RELATIVE_RESOLUTION) for radius in radii]
    candidates: list[Sequence[float]] = list(anchors)
    for i, j in combinations(range(3), 2):
        candidates += _circle_crossings(anchors[i], shrunk[i], anchors[j], shrunk[j])
    return any(
        all(
            math.dist(point, anchor) <= radius * (1.0 + 1e-3 * RELATIVE_RESOLUTION)
            for anchor, radius in zip(anchors, shrunk)
        )
        for point in candidates
    )


def _circle_crossings(
    centre_a: Sequence[float], radius_a: float, centre_b: Sequence[float], radius_b: float
) -> list[Point2]:
    """Return the points that two circles with different centres have in common."""
    distance = math.dist(centre_a, centre_b)
    along = (distance + (radius_a - radius_b) * (radius_a + radius_b) / distance) / 2.0
    squared = (radius_a - along) * (radius_a + along)
    if squared < 0.0:
        return []
    across = math.sqrt(squared)
    ux = (centre_b[0] - centre_a[0]) / distance
    uy = (centre_b[1] - centre_a[1]) / distance
    x = centre_a[0] + along * ux
    y = centre_a[1] + along * uy
    return [(x - across * uy, y + across * ux), (x + across * uy, y - across * ux)]


# The machine of the default parameters, of the demo and of most tests [m].
DEFAULT_GEOMETRY = TriGlideGeometry.symmetric(0.25, 0.05, 0.40)
