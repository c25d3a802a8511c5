r"""The path as programmed: lines, arcs and helices, of numbers that are checked.

All segments have one form. With the way x from the start P of a segment, its unit tangent t there,
what t has along the axis of a helix, r (0 for lines and arcs), the vector n towards the axis, as
long as t - r, and how far the direction turns per way, $\kappa$ (0 for a line),

$$g(x) = P + x r + \frac{\sin \kappa x}{\kappa} (t - r) + \frac{1 - \cos \kappa x}{\kappa} n.$$

The curvature is $\kappa |n|$: that of a helix is smaller than its turn, that of an arc is the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import acos, atan2, cos, dist, hypot, inf, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite, finite_array, finite_vector, positive
from tri_glide_kinematics.errors import OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.interruptible import Interruptible, Kept, accumulated, concatenated
from tri_glide_kinematics.motion.errors import (
    ApartError,
    NoArcError,
    RepeatedPointError,
    ShortSegmentError,
    TooManySegmentsError,
)
from tri_glide_kinematics.vectors import (
    FloatArray,
    Vector3,
    combined,
    cross,
    dot,
    minus,
    plus,
    scaled,
)

# A shorter segment ends where it begins, as far as machines go [m].
SHORTEST = 1e-6

# Ends of segments that are nearer than this are joined [m].
JOINED_WITHIN = 1e-9

# The axis of an arc is at least this long.
LEAST_AXIS = 1e-9

# An arc that is flatter is a line, but for rounding [m].
LARGEST_RADIUS = 1000.0

# A tighter arc is a point, but for rounding [m].
LEAST_RADIUS = 1e-6


NO_VECTOR = (0.0, 0.0, 0.0)


class Segment(NamedTuple):
    """A line, an arc or a helix.

    Attributes:
        end: where it ends. Shape (3,) [m].
        length: [m].
        tangent: unit vector at its start. Shape (3,).
        normal: from its start towards the centre, a unit vector for an arc; of a line, zero.
            Shape (3,).
        curvature: how far the direction turns per way, 0 for a line [rad/m].
        end_tangent: unit vector at its end. Shape (3,).
        end_normal: from its end towards the centre, as ``normal``. Shape (3,).
        tolerance: of the joint at its end [m].
        speed: largest one of the platform, infinite if there is no bound [m/s].
        rise: what the tangent has along the axis of a helix; else zero. Shape (3,).
    """

    end: Vector3
    length: float
    tangent: Vector3
    normal: Vector3
    curvature: float
    end_tangent: Vector3
    end_normal: Vector3
    tolerance: float
    speed: float
    rise: Vector3 = NO_VECTOR


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments of a path, in arrays; as in ``Segment``, the first index is that of the segment.

    Attributes:
        points: the start of the path, and the ends of all segments. Shape (n + 1, 3) [m].
        lengths: Shape (n,) [m].
        tangents: at the starts. Shape (n, 3).
        normals: at the starts. Shape (n, 3).
        curvatures: Shape (n,) [rad/m].
        end_tangents: Shape (n, 3).
        end_normals: Shape (n, 3).
        tolerances: at the ends. Shape (n,) [m].
        speeds: Shape (n,) [m/s].
        rises: Shape (n, 3).
    """

    points: FloatArray
    lengths: FloatArray
    tangents: FloatArray
    normals: FloatArray
    curvatures: FloatArray
    end_tangents: FloatArray
    end_normals: FloatArray
    tolerances: FloatArray
    speeds: FloatArray
    rises: FloatArray

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.lengths)

    @Kept
    def joints(self) -> Interruptible[FloatArray]:
        """Programmed way at the start of the path and at all ends. Shape (n + 1,) [m]."""
        lengths = yield from concatenated((np.zeros(1), self.lengths))
        return (yield from accumulated(np.add, lengths))

    @cached_property
    def is_curved(self) -> bool:
        """Whether one of them is an arc or a helix."""
        return bool(self.curvatures.any())

    @cached_property
    def is_helical(self) -> bool:
        """Whether one of them is a helix."""
        return bool(self.rises.any())

    def reversed(self) -> Segments:
        """Return the same segments, driven the other way; the last tolerance stays the last."""
        back = slice(None, None, -1)
        return Segments(
            self.points[back],
            self.lengths[back],
            -self.end_tangents[back],
            self.end_normals[back],
            self.curvatures[back],
            -self.tangents[back],
            self.normals[back],
            np.concatenate((self.tolerances[:-1][back], self.tolerances[-1:])),
            self.speeds[back],
            -self.rises[back],
        )


def line(
    number: int, start: Vector3, end: Vector3, tolerance: float, speed: float = inf
) -> Segment:
    """Return the line between two points [m].

    Args:
        number: index of the segment, for the texts of errors.
        start: Shape (3,) [m].
        end: Shape (3,) [m].
        tolerance: of the joint at its end [m].
        speed: largest one of the platform [m/s].

    Raises:
        ShortSegmentError: if they coincide.
    """
    length = dist(start, end)
    if not length >= SHORTEST:
        raise ShortSegmentError(number, start, length, SHORTEST)
    x, y, z = ((b - a) / length for a, b in zip(start, end))
    unit = (x, y, z)
    return Segment(end, length, unit, NO_VECTOR, 0.0, unit, NO_VECTOR, tolerance, speed)


def arc_through(
    number: int, start: Vector3, via: Vector3, end: Vector3, tolerance: float, speed: float = inf
) -> Segment:
    """Return the arc from a point by way of another to a third [m]; see ``line``.

    Raises:
        ShortSegmentError: if two of them coincide.
        NoArcError: if they lie on one line.
    """
    for first, second in ((start, via), (via, end), (start, end)):
        length = dist(first, second)
        if not length >= SHORTEST:
            raise ShortSegmentError(number, first, length, SHORTEST)
    chord, to_via, from_via = minus(end, start), minus(via, start), minus(end, via)
    across = cross(to_via, from_via)
    # The radius is that of the circle about the triangle: product of its sides over 4 areas.
    doubled_area, sides = hypot(*across), hypot(*chord) * hypot(*to_via) * hypot(*from_via)
    if not sides <= 2.0 * LARGEST_RADIUS * doubled_area:
        radius = sides / (2.0 * doubled_area) if doubled_area > 0.0 else inf
        reason = "its three points lie on one line, its radius"
        raise NoArcError(number, reason, radius, LARGEST_RADIUS, True)
    axis = scaled(across, 1.0 / doubled_area)
    # The tangent at the start makes the angle with the chord that the arc's rest is seen under
    # from the point between.
    turn = atan2(doubled_area, dot(to_via, from_via))
    length = hypot(*chord)
    along = scaled(chord, 1.0 / length)
    # Across the chord, on the side of the centre if the arc is less than half a turn.
    inwards = cross(axis, along)
    tangent = combined(cos(turn), along, -sin(turn), inwards)
    radius = sides / (2.0 * doubled_area)
    return _arc(number, start, end, tangent, axis, radius, 2.0 * turn, tolerance, speed)


def arc_about(
    number: int,
    start: Vector3,
    centre: Vector3,
    axis: Vector3,
    angle: float,
    tolerance: float,
    speed: float = inf,
    rise: float = 0.0,
) -> Segment:
    """Return the arc, or the helix, from a point about an axis; see ``line``.

    Args:
        number: index of the segment.
        start: Shape (3,) [m].
        centre: a point of the axis; what the axis is not square to is left out. Shape (3,) [m].
        axis: its direction, any vector but zero. Shape (3,).
        angle: right-handed about the axis, of any size but zero [rad].
        tolerance: of the joint at its end [m].
        speed: largest one of the platform [m/s].
        rise: of a helix, how far it leads along the axis [m].

    Raises:
        NoArcError: if the axis or the angle is zero, or the start lies on the axis.
        ShortSegmentError: if the arc has no length.
    """
    size = hypot(*axis)
    if not size >= LEAST_AXIS:
        raise NoArcError(number, "the length of its axis", size, LEAST_AXIS, False, "")
    unit = scaled(axis, 1.0 / size)
    out = minus(start, centre)
    out = combined(1.0, out, -dot(out, unit), unit)
    radius = hypot(*out)
    if not radius >= LEAST_RADIUS:
        reason = "it begins on its axis, its radius"
        raise NoArcError(number, reason, radius, LEAST_RADIUS, False)
    if not radius <= LARGEST_RADIUS:
        raise NoArcError(number, "its radius", radius, LARGEST_RADIUS, True)
    if angle < 0.0:
        unit, angle, rise = scaled(unit, -1.0), -angle, -rise
    if not radius * angle >= SHORTEST:
        raise ShortSegmentError(number, start, radius * angle, SHORTEST)
    out = scaled(out, 1.0 / radius)
    tangent = cross(unit, out)
    # Whole turns end at the place where they begin, to the last bit.
    part = np.remainder(angle, 2.0 * acos(-1.0))
    half = sin(0.5 * part)
    step = combined(radius * sin(part), tangent, -2.0 * radius * half * half, out)
    end = plus(start, step)
    arc = _arc(number, start, end, tangent, unit, radius, angle, tolerance, speed)
    return arc if rise == 0.0 else _helix(arc, unit, rise)


def _helix(arc: Segment, axis: Vector3, rise: float) -> Segment:
    """Return the helix that an ``arc`` about a unit ``axis`` becomes by a ``rise`` along it [m]."""
    length = hypot(arc.length, rise)
    around, along = arc.length / length, scaled(axis, rise / length)
    return arc._replace(
        end=combined(1.0, arc.end, rise, axis),
        length=length,
        tangent=combined(around, arc.tangent, 1.0, along),
        normal=scaled(arc.normal, around),
        curvature=around * arc.curvature,
        end_tangent=combined(around, arc.end_tangent, 1.0, along),
        end_normal=scaled(arc.end_normal, around),
        rise=along,
    )


def _arc(
    number: int,
    start: Vector3,
    end: Vector3,
    tangent: Vector3,
    axis: Vector3,
    radius: float,
    angle: float,
    tolerance: float,
    speed: float,
) -> Segment:
    """Return the arc with a unit ``tangent`` at its start, right-handed about a unit ``axis``."""
    if not radius >= LEAST_RADIUS:
        raise NoArcError(number, "its radius", radius, LEAST_RADIUS, False)
    length = radius * angle
    if not length >= SHORTEST:
        raise ShortSegmentError(number, start, length, SHORTEST)
    normal = cross(axis, tangent)
    end_tangent = combined(cos(angle), tangent, sin(angle), normal)
    end_normal = combined(-sin(angle), tangent, cos(angle), normal)
    curvature = 1.0 / radius
    return Segment(
        end, length, tangent, normal, curvature, end_tangent, end_normal, tolerance, speed
    )


def collected(start: Vector3, segments: Sequence[Segment]) -> Segments:
    """Return ``segments``, of which the first begins at ``start`` [m], in arrays."""
    columns = list(zip(*segments))
    points = np.array((start, *columns[0]))
    return Segments(points, *(np.array(column, dtype=np.float64) for column in columns[1:]))


def polyline(
    points: FloatArray,
    tolerance: float | FloatArray,
    speed: float | FloatArray = inf,
    number: int = 0,
) -> Segments:
    """Return the lines between points.

    Args:
        points: Shape (n + 1, 3) [m].
        tolerance: of each joint, shape (n,), or of all of them [m].
        speed: largest one of the platform on each line, shape (n,), or on all of them [m/s].
        number: index of the first segment, for the texts of errors.

    Raises:
        ShortSegmentError: if two points in succession are the same.
    """
    steps = np.diff(points, axis=0)
    lengths = np.sqrt(np.einsum("ij,ij->i", steps, steps))
    if not lengths.min() >= SHORTEST:
        index = int((~(lengths >= SHORTEST)).argmax())
        x, y, z = points[index].tolist()
        raise ShortSegmentError(number + index, (x, y, z), float(lengths[index]), SHORTEST)
    count = len(steps)
    steps /= lengths[:, np.newaxis]
    return _lines(points, lengths, steps, np.full(count, tolerance), np.full(count, speed))


def _lines(
    points: FloatArray,
    lengths: FloatArray,
    tangents: FloatArray,
    tolerances: FloatArray,
    speeds: FloatArray,
) -> Segments:
    """Return segments that are all lines; what is zero for all of them takes no memory."""
    nothing = np.broadcast_to(0.0, tangents.shape)
    return Segments(
        *(points, lengths, tangents, nothing, nothing[:, 0]),
        *(tangents, nothing, tolerances, speeds, nothing),
    )


# Columns of segments besides points; and those that are not the same for all lines, or all arcs.
COLUMNS = [name for name in Segments.__dataclass_fields__ if name != "points"]
COLUMNS_OF_ARCS = [name for name in COLUMNS if name != "rises"]
COLUMNS_OF_LINES = ["lengths", "tangents", "tolerances", "speeds"]


def joined(parts: Iterable[Segments], backwards: bool = False) -> Interruptible[Segments]:
    """Return segments one after the other, interruptibly after each part.

    Args:
        parts: of one path, small ones if they are made one after the other: each begins where the
            one before it ends.
        backwards: whether the last part comes first.
    """
    made = []
    is_curved = is_helical = False
    for part in parts:
        made.append(part)
        is_curved = is_curved or part.is_curved
        is_helical = is_helical or part.is_helical
        yield
    if len(made) == 1:
        return made[0]
    if backwards:
        made.reverse()
    names = COLUMNS if is_helical else COLUMNS_OF_ARCS if is_curved else COLUMNS_OF_LINES
    rows = {name: [getattr(part, name) for part in made] for name in names}
    places = [made[0].points[:1], *(part.points[1:] for part in made)]
    # From here on, what is put together is given back column by column, not all at once.
    made.clear()
    columns = {}
    for name in names:
        columns[name] = yield from concatenated(rows.pop(name))
    points = yield from concatenated(places)
    if not is_curved:
        return _lines(points, **columns)
    columns.setdefault("rises", np.broadcast_to(0.0, columns["tangents"].shape))
    return Segments(points, **columns)


# No coordinate, and no tolerance, is larger [m].
LARGEST_PLACE = 100.0

# Largest size of a machine, as the parameters of the nodes have it [m].
LARGEST_MACHINE = 10.0

# No arc turns farther [rad].
LARGEST_ANGLE = 1e5

# No speed is larger, or smaller [m/s].
LARGEST_SPEED = 1e6
LEAST_SPEED = 1e-5

# No path has more segments: while a million are rounded they take 0.6 GB where they are dense, and
# 2 GB where each corner stands alone.
MOST_SEGMENTS = 1_000_000


def check_count(count: int) -> None:
    """Check that a path of ``count`` segments is not too long.

    Raises:
        TooManySegmentsError: if it is.
    """
    if count > MOST_SEGMENTS:
        raise TooManySegmentsError(count, MOST_SEGMENTS)


def check_joined(before: Segments, after: Segments) -> None:
    """Check that segments begin where those before end.

    Raises:
        ApartError: if they begin elsewhere.
    """
    end, start = before.points[-1].tolist(), after.points[0].tolist()
    distance = dist(end, start)
    if not distance <= JOINED_WITHIN:
        raise ApartError(end, start, distance, JOINED_WITHIN)


def check_coordinates(points: FloatArray, first: int) -> None:
    """Check ``points``, shape (n, 3) [m], of which the index ``first`` is that of the first one.

    Raises:
        NotFiniteError: if a number is NaN or infinite.
        OutOfBoundsError: if a number is too large.
    """
    bad = ~(np.abs(points) <= LARGEST_PLACE)
    if bad.any():
        row, column = np.argwhere(bad)[0].tolist()
        coordinate_of(f"points[{first + row}][{column}]", float(points[row, column]))


def coordinate_of(name: str, value: float) -> float:
    """Return ``value`` if it is finite and not too large [m]."""
    number = finite(name, value)
    if abs(number) > LARGEST_PLACE:
        bound = f"from -{LARGEST_PLACE:g} to {LARGEST_PLACE:g}"
        raise OutOfBoundsError(name, number, bound, "m", LARGEST_MACHINE)
    return number


def place_of(name: str, values: Iterable[float]) -> Vector3:
    """Return ``values`` as three plain numbers that are finite and not too large [m]."""
    x, y, z = finite_vector(name, values, 3)
    if not max(abs(x), abs(y), abs(z)) <= LARGEST_PLACE:
        for index, value in enumerate((x, y, z)):
            coordinate_of(f"{name}[{index}]", value)
    return x, y, z


def points_of(points: ArrayLike) -> FloatArray:
    """Return a copy of the ``points`` of a polyline, shape (n, 3) [m].

    Raises:
        KinematicsError: see ``PlatformPath.through``.
    """
    places = finite_array("points", points, (None, 3))
    if len(places) < 2:
        raise WrongShapeError("points", places.shape, "(n, 3) with n at least 2")
    check_count(len(places) - 1)
    check_coordinates(places, 0)
    steps = np.diff(places, axis=0)
    short = np.flatnonzero(~(np.einsum("ij,ij->i", steps, steps) >= SHORTEST * SHORTEST))
    if len(short):
        index = int(short[0])
        length = float(np.linalg.norm(steps[index]))
        raise RepeatedPointError(index, index, places[index].tolist(), length, SHORTEST)
    return places.copy()


def tolerance_of(number: int, value: float) -> float:
    """Return the tolerance of the segment with the index ``number`` [m]."""
    tolerance = coordinate_of(f"tolerance of segment {number + 1}", value)
    if tolerance < 0.0:
        name = f"tolerance of segment {number + 1}"
        raise OutOfBoundsError(name, tolerance, "at least 0", "m")
    return tolerance


def speed_of(number: int, value: float | None) -> float:
    """Return the speed of the segment with the index ``number``, infinite if it has none [m/s]."""
    if value is None:
        return inf
    name = f"speed of segment {number + 1}"
    speed = positive(name, value, "m/s", LARGEST_SPEED)
    if speed < LEAST_SPEED:
        raise OutOfBoundsError(name, speed, f"at least {LEAST_SPEED:g}", "m/s")
    return speed
