r"""Taught, not typed: belt, camera, latency and gripper, from a few touches and views.

The order is gripper, belt, latency, camera: each is used by those after it. Whoever touches and
picks with the same point of the gripper, and types no place in the frame of the machine, can leave
its offset at zero: it is in all touches alike.

All are least squares. A deviation is a standard deviation: from the residuals, but at least from
the ``noise`` of one observation, as a few that agree by chance are no better than each can be. The
nearer to each other the observations are, the larger it is. One that is too large is refused.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np

from tri_glide_kinematics.calibration.fit import rotation_by
from tri_glide_kinematics.checks import SMALLEST, finite, finite_array, positive
from tri_glide_kinematics.equal_numbers import first_largest
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.picking.belt import BeltState
from tri_glide_kinematics.vectors import FloatArray, Vector3, plus, three
from tri_glide_kinematics.wording import number_text, vector_text

Taught = TypeVar("Taught")

# Standard deviation of a touch, or of a part that is seen, along each axis [m].
NOISE = 0.0002
# An observation farther than this from where the others say is of another mark or part [m].
FARTHEST = 0.005
# Marks, views and parts have to be spread at least so far [m], speeds of the belt so much [m/s].
SPREAD = 0.01
# A camera is mirrored if its parts fit so many times better that way.
MIRROR_RATIO = 3.0

# Pictures that are kept to teach by, and how old those may be that teach a latency [s].
MOST_VIEWS, SEEN_OF_LATE = 500, 2.0


class TeachingError(KinematicsError):
    """An observation contradicts the others: another mark or part, or a picture in a mirror.

    Attributes:
        value: the number that is wrong.
        bound: that it breaks, in words.
    """

    def __init__(self, what: str, value: float, bound: str, unit: str = "") -> None:
        """Store the ``value`` of ``what``, in words, and its ``bound``, both in a ``unit``."""
        super().__init__(f"{what}: {number_text(value, 3, 0.0)}{unit}, {bound}{unit}")
        self.value = value
        self.bound = bound

    @classmethod
    def at_most(cls, what: str, value: float, bound: float, unit: str = "") -> None:
        """Raise this error if a ``value`` is above its ``bound``, or NaN."""
        if not value <= bound:
            raise cls(what, value, f"at most {bound:g}", unit)


class NotEnoughError(TeachingError):
    """Observations are too few, too much alike or too uncertain: more are needed, farther apart."""

    @classmethod
    def at_least(cls, what: str, value: float, bound: float, unit: str = "") -> None:
        """Raise this error if a ``value`` is below its ``bound``, or NaN."""
        if not value >= bound:
            raise cls(what, value, f"at least {bound:g}", unit)


@dataclass(frozen=True)
class Observed:
    """A mark or part on the belt as it was touched, or seen.

    Attributes:
        position: of a touch: that of the gripper's point, which is the platform's plus the taught
            offset [m]. Of a view: in the frame and unit of the camera; without depth, z is 0.
        counts: of the belt's encoder, without wraps, at the touch, or at the stamp of the picture.
        rate: of the counts then [1/s].
    """

    position: Vector3
    counts: float
    rate: float = 0.0


@dataclass(frozen=True)
class TaughtBelt:
    """Where and how far the belt goes.

    Attributes:
        direction: in which the belt goes when the encoder counts upwards, a unit vector.
        metres_per_count: above 0.
        deviation: of the end of a way, along each axis, as part of the way: that of the direction
            [rad], and of ``metres_per_count`` as part of it.
    """

    direction: Vector3
    metres_per_count: float
    deviation: float


@dataclass(frozen=True)
class TaughtLatency:
    """How long before its stamp a picture was made.

    Attributes:
        latency: above 0 if the stamp is late [s].
        deviation: [s].
    """

    latency: float
    deviation: float


@dataclass(frozen=True)
class TaughtGripper:
    """Where the gripper's point is.

    Attributes:
        offset: from the platform to the point; z is below 0 for one that is below [m].
        deviation: along each axis [m].
    """

    offset: Vector3
    deviation: float


@dataclass(frozen=True)
class TaughtCamera:
    """The place of a camera in the frame of the machine, and how late its stamps are.

    Attributes:
        position: of the origin of the camera's frame [m].
        roll_pitch_yaw: turns about the fixed axes x, y, z, one after the other, as in URDF [rad].
        scale: of a unit of the camera [m]: 1 for one that tells metres, and means them.
        latency: by which the stamp of a picture is late [s].
        deviation: of a place that the camera tells, along the axis where it is largest, and at that
            of the taught parts where it is largest [m].
    """

    position: Vector3
    roll_pitch_yaw: Vector3
    scale: float = 1.0
    latency: float = 0.0
    deviation: float = math.nan

    def place_of(self, seen: Vector3) -> Vector3:
        """Return the place in the frame of the machine [m] of a position ``seen`` by the camera."""
        return three(self.position + self.scale * self.rotation @ seen)

    @cached_property
    def rotation(self) -> FloatArray:
        """The axes of the camera in the frame of the machine, as columns. Shape (3, 3)."""
        roll, pitch, yaw = np.diag(self.roll_pitch_yaw)
        return rotation_by(yaw) @ rotation_by(pitch) @ rotation_by(roll)


def teach_belt(
    touches: Sequence[Observed], noise: float = NOISE, allowed: float = 0.003
) -> TaughtBelt:
    """Return the belt by two or more touches of one mark, between which the belt has run.

    Args:
        touches: of one mark.
        noise: standard deviation of one touch along each axis [m].
        allowed: the largest deviation.

    Raises:
        NotEnoughError: if there are fewer than two, the mark was in about the same place, the
            counts are the same, or the deviation is above ``allowed``.
        TeachingError: if one is not on the line of the others, or not where its counts say.
    """
    ways, runs, _ = (v - v.mean(axis=0) for v in _observed("touches of a mark", touches, 2))
    square = max(float(runs @ runs), SMALLEST)
    per_count = runs @ ways / square
    length = math.hypot(*per_count)
    NotEnoughError.at_least("way between the touches", length * float(np.ptp(runs)), SPREAD, " m")
    deviation = _noise("touch", ways - np.outer(runs, per_count), 6, noise)
    deviation /= length * math.sqrt(square)
    NotEnoughError.at_most("deviation of the belt as part of its way", deviation, allowed)
    return TaughtBelt(three(per_count / length), length, deviation)


def teach_latency(
    views: Sequence[Observed], belt: TaughtBelt, noise: float = NOISE, allowed: float = 0.002
) -> TaughtLatency:
    r"""Return the latency of a camera by views of one part, at two or more speeds of the belt.

    With the latency L, a part is seen at $c = a + d (s - L v)$, for the way s and velocity v of the
    belt at the stamp: the place a and the way d in the camera for a metre of belt are fitted, too,
    so the place of the camera need not be known.

    Args:
        views: of one part, which stays where it is on the belt, while that runs at constant speeds;
            one of them may be 0, and it may run back.
        belt: taught before.
        noise: standard deviation of one view along the belt [m].
        allowed: the largest deviation [s].

    Raises:
        NotEnoughError: if there are fewer than four views, all are at about the same place of the
            belt or at the same speed, the speed changes with the place alone, or the deviation is
            above ``allowed``.
        TeachingError: if a view is far from where the others say.
    """
    places, ways, speeds = (v - v.mean(axis=0) for v in _observed("views of a part", views, 4))
    ways, speeds = belt.metres_per_count * ways, belt.metres_per_count * speeds
    NotEnoughError.at_least("way of the belt between the views", float(np.ptp(ways)), SPREAD, " m")
    square = float(ways @ ways)
    # Changes of the speed that go with the place say nothing of the latency.
    slope = float(ways @ speeds) / square
    changes = speeds - slope * ways
    unlike = float(changes @ changes)
    NotEnoughError.at_least("spread of the speeds at one place", changes.std(), SPREAD, " m/s")
    per_speed = changes @ places / unlike
    per_metre = ways @ places / square - slope * per_speed
    along = per_metre / max(float(per_metre @ per_metre), SMALLEST)
    latency = -float(per_speed @ along)
    deviation = _noise("view", np.c_[places @ along - ways + latency * speeds], 3, noise)
    # Where speed and place go together, or the latency is long, d is not sure either.
    deviation *= math.sqrt((1.0 - latency * slope) ** 2 / unlike + latency**2 / square)
    NotEnoughError.at_most("deviation of the latency", deviation, allowed, " s")
    return TaughtLatency(latency, deviation)


def teach_camera(
    parts: Sequence[tuple[Observed, Observed]],
    belt: TaughtBelt,
    latency: float = 0.0,
    noise: float = NOISE,
    allowed: float = 0.001,
) -> TaughtCamera:
    """Return the place of a camera by four or more parts that it has seen and that were touched.

    The unit of the camera is fitted, too: it may tell pixels, or metres for another height. Parts
    in one plane do not tell a picture from its mirror image: it is one from below. Places in this
    plane are right then, too.

    Args:
        parts: each as it was seen, and as it was touched, there or farther along the belt.
        belt: taught before.
        latency: of the camera, taught before; of no matter for parts seen while the belt rests [s].
        noise: standard deviation of one part, seen and touched, along each axis [m].
        allowed: the largest deviation [m].

    Raises:
        NotEnoughError: if there are fewer than four, they lie almost on one line, or the deviation
            is above ``allowed``.
        TeachingError: if they fit a mirror image much better, or one is far from where the others
            say.
    """
    (places, counts, _), (seen, seen_counts, rates) = (
        _observed("parts seen and touched", [part[side] for part in parts], 4) for side in (1, 0)
    )
    runs = seen_counts - finite("latency", latency) * rates - counts
    places = places + np.outer(runs, belt.direction) * belt.metres_per_count
    center, seen_center, count = places.mean(axis=0), seen.mean(axis=0), len(places)
    ways, seen = places - center, seen - seen_center
    across = np.linalg.svd(ways, compute_uv=False)[1] / math.sqrt(count)
    NotEnoughError.at_least("spread of the parts beside one line", across, SPREAD, " m")
    rotation, scale, residuals = _turned(seen, ways)
    off, mirrored = (math.sqrt((r**2).mean()) for r in (residuals, _turned(-seen, ways)[2]))
    most = MIRROR_RATIO * max(mirrored, noise)
    TeachingError.at_most("distance without a mirror (turn one axis round)", off, most, " m")
    deviation = _noise("part", residuals, 7, noise)
    # How a place moves with a turn about each axis, as rows. Shape (n, 3, 3).
    turns = np.cross(np.eye(3), ways[:, None])
    by_turn = np.swapaxes(turns, 1, 2) @ np.linalg.inv((turns @ np.swapaxes(turns, 1, 2)).sum(0))
    by_scale = ways[:, :, None] * ways[:, None] / float((ways**2).sum())
    variance = np.linalg.eigvalsh(np.eye(3) / count + by_turn @ turns + by_scale).max()
    deviation *= math.sqrt(variance)
    NotEnoughError.at_most("deviation of a place by the camera", deviation, allowed, " m")
    position = three(center - scale * rotation @ seen_center)
    return TaughtCamera(position, _roll_pitch_yaw(rotation), scale, latency, deviation)


def teach_gripper(
    touches: Sequence[tuple[Vector3, Vector3]], noise: float = NOISE, allowed: float = 0.0005
) -> TaughtGripper:
    """Return the offset of the gripper's point, by touches of marks at known places.

    The platform does not turn, so no number of touches of a mark that is not known tells the
    offset. One is known by a probe with a known point, or by the drawing of the frame.

    Args:
        touches: the place of a mark, and of the platform while the point touches it [m].
        noise: standard deviation of one touch and of the place of its mark, along each axis [m].
        allowed: the largest deviation [m].

    Raises:
        NotEnoughError: if there are none, or the deviation is above ``allowed``.
        TeachingError: if one is far from where the others say.
    """
    NotEnoughError.at_least("touches of marks", len(touches), 1)
    marks, platforms = np.swapaxes(finite_array("touches", touches, (None, 2, 3)), 0, 1)
    offset = (marks - platforms).mean(axis=0)
    deviation = _noise("touch", marks - platforms - offset, 3, noise) / math.sqrt(len(marks))
    NotEnoughError.at_most("deviation of the gripper's point", deviation, allowed, " m")
    return TaughtGripper(three(offset), deviation)


def _turned(seen: FloatArray, ways: FloatArray) -> tuple[FloatArray, float, FloatArray]:
    """Return the turn and scale that bring ``seen`` to ``ways``, both centred; the residuals."""
    # It loads scipy, which a cell that is taught already does not need.
    from tri_glide_kinematics.calibration.fit import placement

    rotation = placement(seen, ways).rotation
    turned = seen @ rotation.T
    scale = float((turned * ways).sum()) / max(float((turned**2).sum()), SMALLEST)
    return rotation, scale, ways - scale * turned


def _roll_pitch_yaw(rotation: FloatArray) -> Vector3:
    """Return the angles of a ``rotation``; roll fits the yaw also where both are about one axis."""
    (xx, xy, xz), (yx, yy, yz), (zx, _, _) = rotation.tolist()
    yaw = math.atan2(yx, xx)
    sine, cosine = math.sin(yaw), math.cos(yaw)
    roll = math.atan2(sine * xz - cosine * yz, cosine * yy - sine * xy)
    return roll, math.atan2(-zx, math.hypot(xx, yx)), yaw


def _observed(what: str, observations: Sequence[Observed], least: int) -> list[FloatArray]:
    """Return positions (n, 3), counts (n,) and their rates (n,), checked."""
    NotEnoughError.at_least(what, len(observations), least)
    rows = [(*one.position, one.counts, one.rate) for one in observations]
    numbers = finite_array(what, rows, (None, 5))
    return [numbers[:, :3], numbers[:, 3], numbers[:, 4]]


def _noise(what: str, residuals: FloatArray, unknowns: int, noise: float) -> float:
    """Return the standard deviation of an observation along each axis [m]; none may be far off.

    Args:
        what: one observation is, in words.
        residuals: Shape (n, k) [m].
        unknowns: how many numbers were fitted.
        noise: the least one [m].
    """
    distances = np.sqrt((residuals**2).sum(axis=1))
    worst = first_largest(distances)
    text = f"distance of {what} {worst + 1} from where the others say"
    TeachingError.at_most(text, float(distances[worst]), FARTHEST, " m")
    free = max(residuals.size - unknowns, 1)
    return max(math.sqrt(float((residuals**2).sum()) / free), positive("noise", noise))


@dataclass(frozen=True)
class TaughtCell:
    """All that is taught.

    Attributes:
        point: of the gripper, from that of the platform [m].
        belt: where and how far it goes.
        cameras: by their frames.
    """

    point: Vector3
    belt: TaughtBelt
    cameras: Mapping[str, TaughtCamera]

    def with_camera(self, name: str, camera: TaughtCamera) -> TaughtCell:
        """Return the cell with another place, or latency, of a camera."""
        return replace(self, cameras={**self.cameras, name: camera})


class Scene(NamedTuple):
    """How things are when something is taught.

    Attributes:
        now: the time [s].
        platform: where it rests; None if it does not, or is not known [m].
        belt: how it moves; None if that is not known.
        mark: a known place that the gripper may touch [m].
    """

    now: float
    platform: Vector3 | None
    belt: BeltState | None
    mark: Vector3


class View(NamedTuple):
    """A picture with one part in it.

    Attributes:
        camera: its frame.
        time: by its stamp [s].
        observed: the part, and the belt by that stamp.
    """

    camera: str
    time: float
    observed: Observed


class NotNowError(KinematicsError):
    """What is to be taught cannot be, as things are."""


class Lessons:
    """Touches and views, by what they teach.

    One that contradicts those before is not kept. Where it was those that were wrong, begin anew.
    """

    def __init__(self) -> None:
        """Know none yet."""
        self._kept: dict[str, list[Any]] = {}
        self._views: deque[View] = deque(maxlen=MOST_VIEWS)

    def see(self, view: View) -> None:
        """Keep a picture, as that may be taught by."""
        self._views.append(view)

    def teach(self, what: str, cell: TaughtCell, scene: Scene) -> tuple[TaughtCell, str]:
        """Take one more lesson, and return the cell as it is known now, and that in words.

        Args:
            what: "gripper" (it touches the known mark), "belt" (it touches the mark on the belt),
                "latency" (a part passes), "camera" (it touches the part that was seen last) or
                "forget".
            cell: as it was known before.
            scene: now.

        Raises:
            TeachingError: if that is not enough, or does not fit.
            NotNowError: if it cannot be now.
        """
        if what == "forget":
            self._kept.clear()
            return cell, "all touches and views are forgotten; what is in use stays"
        if what == "latency":
            return self._latency(cell, scene.now)
        if scene.platform is None:
            raise NotNowError("the platform must rest, and its position be known")
        if what == "gripper":
            gripper = self._solved(what, [(scene.mark, scene.platform)], teach_gripper)
            text = f"point of the gripper: {vector_text(gripper.offset)} m from the platform's"
            return replace(cell, point=gripper.offset), _within(text, gripper.deviation)
        if scene.belt is None:
            raise NotNowError("the position of the belt is not known")
        belt = cell.belt
        touch = Observed(
            plus(scene.platform, cell.point), scene.belt.position / belt.metres_per_count
        )
        if what == "belt":
            belt = self._solved(what, [touch], teach_belt)
            text = f"direction of the belt: {vector_text(belt.direction)}; "
            text = _within(f"{text}{belt.metres_per_count:g} m for 1", belt.deviation)
            return replace(cell, belt=belt), f"{text} in a metre"
        if what != "camera":
            names = "gripper, belt, latency, camera or forget"
            raise NotNowError(f"what = {what!r} must be {names}")
        name, _, seen = _last(self._views)
        latency = cell.cameras[name].latency
        camera = self._solved(
            f"place of {name}", [(seen, touch)], lambda parts: teach_camera(parts, belt, latency)
        )
        text = f"place of {name}: {vector_text(camera.position)} m"
        return cell.with_camera(name, camera), _within(text, camera.deviation)

    def _latency(self, cell: TaughtCell, now: float) -> tuple[TaughtCell, str]:
        """Return the cell with the latency of the camera that sees a part pass at one speed."""
        views = [view for view in self._views if view.time > now - SEEN_OF_LATE]
        name = _last(views).camera
        seen = [view.observed for view in views if view.camera == name]
        text = f"latency of {name}"
        taught = self._solved(text, seen, lambda all_: teach_latency(all_, cell.belt))
        camera = replace(cell.cameras[name], latency=taught.latency)
        text = f"{text}: {taught.latency:.4f} s, within {taught.deviation:.4f} s"
        return cell.with_camera(name, camera), text

    def _solved(
        self, what: str, new: Sequence[Any], solve: Callable[[Sequence[Any]], Taught]
    ) -> Taught:
        """Solve with ``new`` observations, and keep them if they fit."""
        kept = self._kept.setdefault(what, [])
        try:
            taught = solve([*kept, *new])
        except NotEnoughError:
            kept.extend(new)
            raise
        kept.extend(new)
        return taught


def _last(views: Sequence[View]) -> View:
    if not views:
        raise NotNowError("no picture with exactly one part was seen")
    return views[-1]


def _within(text: str, deviation: float) -> str:
    return f"{text}, within {1000.0 * deviation:.2g} mm"
