"""Paths at random, and their distance from the path as programmed, found without its formulas."""

import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.path import DrivenPath, PlatformPath, Segments
from tri_glide_kinematics.vectors import FloatArray

# Two paths are driven alike as long as they differ by no more than this [m].
DRIVEN_ALIKE = 1e-12

# Distance from lines and arcs that are kept [m].
ROUNDING = 1e-9


class Piece(NamedTuple):
    """A line, an arc or a helix as it was asked for; a line has no ``centre``."""

    start: FloatArray
    end: FloatArray
    tolerance: float
    centre: FloatArray | None = None
    axis: FloatArray | None = None
    angle: float = 0.0
    rise: float = 0.0


def dense_ways(driven: DrivenPath, count: int = 1000) -> FloatArray:
    """Return so many ways along a path [m], and its breaks."""
    return np.unique(np.concatenate((np.linspace(0.0, driven.length, count), driven.breaks)))


def part_of(segments: Segments, first: int, last: int) -> Segments:
    """Return some segments of a path."""
    names = [name for name in segments.__dataclass_fields__ if name != "points"]
    columns = (getattr(segments, name)[first:last] for name in names)
    return Segments(segments.points[first : last + 1], *columns)


def random_path(
    rng: np.random.Generator,
    count: int | None = None,
    arcs: float = 0.4,
    stops: float = 0.1,
    centre: tuple[float, float, float] = (0.0, 0.0, 0.3),
    size: float = 0.1,
    helices: float = 0.0,
) -> tuple[PlatformPath, list[Piece]]:
    """Lines and arcs in all planes, 2 to 40, with tolerances of 0.05 to 10 mm or stops.

    So many arcs of one are ``helices``.
    """
    count = count or int(rng.integers(2, 41))
    here = np.array(centre) + rng.uniform(-size, size, 3)
    path = PlatformPath.start(here)
    pieces: list[Piece] = []
    for _ in range(count):
        tolerance = 0.0 if rng.random() < stops else 1e-3 * 10.0 ** rng.uniform(-1.3, 1.0)
        length = size * 10.0 ** rng.uniform(-2.0, 0.0)
        kind = rng.random()
        if kind < arcs:
            radius = size * 10.0 ** rng.uniform(-1.5, 0.0)
            axis = unit(rng)
            out = np.cross(axis, unit(rng))
            out /= np.linalg.norm(out)
            if pieces and rng.random() < 0.5:
                # Tangent to what is before it.
                ahead = path.segments.end_tangents[-1]
                axis = np.cross(ahead, unit(rng))
                axis /= np.linalg.norm(axis)
                out = np.cross(ahead, axis)
            middle = here - radius * out
            angle = rng.choice((-1.0, 1.0)) * rng.uniform(0.05, 7.0)
            is_helix = helices > 0.0 and rng.random() < helices
            rise = size * rng.uniform(-1.0, 1.0) if is_helix else 0.0
            after = path.arc_about(middle, axis, angle, tolerance, rise=rise)
            end = np.array(after.end)
            pieces.append(Piece(here, end, tolerance, middle, axis, angle, rise))
        else:
            direction = unit(rng)
            if pieces and rng.random() < 0.2:
                direction = path.segments.end_tangents[-1]
            end = here + length * direction
            after = path.line_to(end, tolerance)
            pieces.append(Piece(here, end, tolerance))
        path, here = after, end
    return path, pieces


def unit(rng: np.random.Generator) -> FloatArray:
    """Return a direction at random. Shape (3,)."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))


def distances(places: FloatArray, piece: Piece) -> FloatArray:
    """Return the distances of places, shape (n, 3), from a piece. Shape (n,) [m]."""
    if piece.centre is None or piece.axis is None:
        step = piece.end - piece.start
        part = np.clip((places - piece.start) @ step / (step @ step), 0.0, 1.0)
        return np.linalg.norm(places - piece.start - part[:, np.newaxis] * step, axis=1)
    if piece.rise:
        return distances_from_helix(places, piece)
    out = piece.start - piece.centre
    radius = np.linalg.norm(out)
    across = np.cross(piece.axis, out)
    from_centre = places - piece.centre
    height = from_centre @ piece.axis
    turned = np.arctan2(from_centre @ across, from_centre @ out) * math.copysign(1.0, piece.angle)
    inside = np.mod(turned, 2.0 * math.pi) <= abs(piece.angle)
    flat = np.linalg.norm(from_centre - height[:, np.newaxis] * piece.axis, axis=1)
    to_ring = np.hypot(flat - radius, height)
    to_ends = np.minimum(
        np.linalg.norm(places - piece.start, axis=1), np.linalg.norm(places - piece.end, axis=1)
    )
    return np.where(inside, to_ring, to_ends)


def largest_part(path: PlatformPath, pieces: list[Piece], places: FloatArray) -> float:
    """Return how far places, shape (n, 3), are from ``pieces`` at most, in parts of the tolerance.

    Each place has to be near enough to one of them. On a piece the larger tolerance of the next
    joints before and behind that are no smooth ones holds.
    """
    driven = path.driven
    real = np.union1d(driven.rounded.ways, driven.stops)
    tolerances = np.append(0.0, path.segments.tolerances)[np.searchsorted(driven.joints, real)]
    following = np.searchsorted(real, 0.5 * (driven.joints[1:] + driven.joints[:-1]))
    allowed = np.maximum(np.maximum(tolerances[following - 1], tolerances[following]), ROUNDING)
    away = [distances(places, piece) / most for piece, most in zip(pieces, allowed.tolist())]
    return float(np.min(away, axis=0).max())


def distances_from_helix(places: FloatArray, piece: Piece) -> FloatArray:
    """Return the distances from a helix: the nearest of many points, moved by Newton's method."""
    centre, axis = np.array(piece.centre), np.array(piece.axis)
    out = piece.start - centre
    out = out - (out @ axis) * axis
    across, along = np.cross(axis, out), piece.rise * axis

    def derivatives(parts: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        turned = piece.angle * parts[:, np.newaxis]
        outwards = np.cos(turned) * out + np.sin(turned) * across
        slope = piece.angle * (np.cos(turned) * across - np.sin(turned) * out) + along
        points = piece.start - out + outwards + parts[:, np.newaxis] * along
        return points, slope, -(piece.angle**2) * outwards

    samples = np.linspace(0.0, 1.0, 400)
    apart = places[:, np.newaxis] - derivatives(samples)[0]
    parts = samples[np.linalg.norm(apart, axis=2).argmin(axis=1)]
    for _ in range(8):
        points, slope, bend = derivatives(parts)
        excess = np.einsum("ij,ij->i", points - places, slope)
        rate = np.einsum("ij,ij->i", slope, slope) + np.einsum("ij,ij->i", points - places, bend)
        parts = np.clip(parts - np.where(rate > 0.0, excess / rate, 0.0), 0.0, 1.0)
    return np.linalg.norm(places - derivatives(parts)[0], axis=1)


def sides_of_breaks(driven: DrivenPath) -> tuple[FloatArray, FloatArray, float]:
    """Return derivatives on both sides of the breaks of a path where it does not stop.

    Returns:
        Positions and two derivatives before and after them, each of the shape (3, n, 3), and what
        the second derivatives are to be compared with.
    """
    inner = driven.breaks[1:-1]
    inner = inner[np.abs(inner[:, np.newaxis] - driven.stops).min(axis=1) > 1e-9]
    after = driven.spans_of(inner)
    left = driven.derivatives_on(after - 1, inner, 2)
    right = driven.derivatives_on(after, inner, 2)
    return left, right, 1.0 + float(np.abs(right[2]).max(initial=0.0))


def agree_until(one: DrivenPath, other: DrivenPath) -> float:
    """Return the programmed way up to which two paths are driven alike [m].

    With segments added, a path is driven otherwise near its former end, where it stopped.
    """
    count = min(len(one.table), len(other.table))
    columns = min(one.table.shape[1], other.table.shape[1])
    steps = np.diff(one.breaks[: count + 1])[:, np.newaxis]
    apart = np.abs(one.table[:count, :columns] - other.table[:count, :columns]).max(axis=2)
    apart *= steps ** np.arange(columns)
    for path in (one, other):
        beyond = np.abs(path.table[:count, columns:]).max(axis=(1, 2), initial=0.0)
        apart[:, 0] += beyond * steps[:, 0] ** columns
    differs = (apart.max(axis=1) > DRIVEN_ALIKE) | (one.segment[:count] != other.segment[:count])
    ends, other_ends = one.breaks[1 : count + 1], other.breaks[1 : count + 1]
    parted = differs | (np.abs(ends - other_ends) > DRIVEN_ALIKE)
    first = int(np.flatnonzero(np.append(parted, True))[0])
    # One of two equal spans may be longer.
    if first < count and not differs[first]:
        return float(min(ends[first], other_ends[first]))
    return float(one.breaks[first])
