"""Whether recorded setpoints keep all limits, by the numbers in the recording alone.

A machine publishes one setpoint in each cycle, a period of its motion after the one before. The
stamp of a message tells when it was sent, which is late by some tenths of a millisecond now and
then. So heights are compared over the *period*, and stamps tell the order and the gaps alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.checks import non_negative, positive
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limit_use import (
    LIMIT_TOLERANCE,
    ROUNDING_STEPS,
    CommandStream,
    LimitUse,
)
from tri_glide_kinematics.motion.limits import QUANTITIES, AddedBound, SeenParts, SliderLimits
from tri_glide_kinematics.recordings.setpoint_files import Recording
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text
from tri_glide_kinematics.workspace import OVERRUN_TOLERANCES, Workspace, overruns

# The longest time between two stamps, in periods: a setpoint that is later is missing.
LONGEST_GAP = 2.5

# A setpoint that is later than this number of periods may be the one after one that was lost.
LATE = 1.5

# The times between two stamps differ from the period by no more than this part of it, in the
# median: on a computer that is too busy, every cycle is late.
SAME_PERIOD = 0.3

# Number of rows that are looked at together.
BLOCK = 100_000
# A jerk is a difference over so many rows before its own.
ROWS_BEFORE = 3

Rows = NDArray[np.bool_]


class WrongPeriodError(KinematicsError):
    """The messages of a recording are farther apart, or nearer, than the period that was named."""

    def __init__(self, found: float, period: float) -> None:
        """Store what was ``found`` and the ``period`` that was named [s]."""
        super().__init__(
            f"the setpoints are {1e3 * found:.3f} ms apart, and the rate is {1.0 / period:g} Hz: "
            f"name the right one, {1.0 / found:.4g} Hz as it seems"
        )
        self.found = found
        self.period = period


class Kind(Enum):
    """What is wrong with a recording."""

    NOT_FINITE = "not finite"
    ORDER = "order"
    GAP = "gap"
    PUBLISHED_VELOCITY = "published velocity"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    JERK = "jerk"
    TRAVEL = "travel"
    REACH = "reach"
    PLACE = "box or cylinder"
    CONDITION = "condition number"
    PLATFORM_SPEED = "platform speed"
    FORCE = "force"
    # A bound whose quantity is none of these.
    ADDED_BOUND = "added bound"


class Violation(NamedTuple):
    """What is wrong in one way, and where it is worst.

    Attributes:
        kind: of it.
        time: of the worst row, since the first row [s].
        value: there, in the unit of the text; NaN if it is none.
        bound: that it passes.
        rows: how many there are.
        first: time of the first of them [s].
        text: of the worst one, with number and bound.
    """

    kind: Kind
    time: float
    value: float
    bound: float
    rows: int
    first: float
    text: str


@dataclass(frozen=True)
class Judgement:
    """What a recording has shown.

    Attributes:
        rows: how many setpoints there are.
        duration: from the first stamp to the last [s].
        beginnings: how many stretches of setpoints there are.
        largest: velocity, acceleration and jerk as parts of their limits.
        added: speed of the platform, force and whatever else is bounded as parts of their limits,
            where there are such.
        longest_gap: longest time between two stamps in a stretch [s].
        last_speed: of the fastest slider at the last setpoint, as published, or else by the
            heights; 0 if the recording ends at rest, but for rounding [m/s].
        violations: each kind once.
    """

    rows: int
    duration: float
    beginnings: int
    largest: Vector3
    added: Mapping[Kind, float]
    longest_gap: float
    last_speed: float
    violations: tuple[Violation, ...]


def judge(
    recording: Recording,
    workspace: Workspace,
    limits: SliderLimits,
    period: float,
    *,
    longest_gap: float | None = None,
    may_pause: bool = False,
    height_offsets: Vector3 = (0.0, 0.0, 0.0),
) -> Judgement:
    """Compare the setpoints of a recording with all limits.

    Args:
        recording: with heights as the drives are told.
        workspace: where platform and sliders may be, and of which machine.
        limits: of the sliders, with what bounds all motion besides.
        period: of the motion from one setpoint to the next [s].
        longest_gap: that there may be between two stamps [s]; None for 2.5 periods.
        may_pause: whether the setpoints may end at rest and begin anew, maybe elsewhere, as those
            of a machine that is disabled and enabled again.
        height_offsets: true heights less those that the drives are told. Shape (3,) [m].

    Raises:
        WrongPeriodError: if the median of the times between two stamps is not the ``period``.
        KinematicsError: if there are no two setpoints, or a number is out of bounds.
    """
    positive("period", period, "s")
    bound = LONGEST_GAP * period if longest_gap is None else longest_gap
    non_negative("longest_gap", bound, "s")
    if len(recording.stamps) < 2:
        raise KinematicsError(f"{len(recording.stamps)} setpoints, at least 2 are needed")
    judging = _Judging(recording, period, np.array(height_offsets))
    judging.look_at_stamps(bound, limits, may_pause)
    judging.look_at_heights(workspace, limits)
    for added in limits.added:
        judging.look_at_added(added)
    return judging.judgement()


class _Judging:
    """Looks at the rows of one recording that have numbers only."""

    def __init__(self, recording: Recording, period: float, offsets: FloatArray) -> None:
        self._violations: list[Violation] = []
        stamps, heights, velocities = recording.stamps, recording.heights, recording.velocities
        finite = np.isfinite(stamps) & np.isfinite(heights).all(axis=1)
        if velocities is not None:
            finite &= np.isfinite(velocities).all(axis=1)
        self._times = stamps
        self._check_finite(recording, finite)
        kept = np.flatnonzero(finite)
        self._times = stamps[kept]
        self._heights = heights[kept] + offsets
        self._velocities = None if velocities is None else velocities[kept]
        # A row behind one that is left out begins anew.
        self._begins = np.diff(kept, prepend=-2) > 1
        self._resolution = recording.resolution
        self._period = period
        self._rows = len(stamps)
        self._largest = (0.0, 0.0, 0.0)
        self._added: dict[Kind, float] = {}
        self._longest_gap = 0.0

    def _check_finite(self, recording: Recording, finite: Rows) -> None:
        if finite.all():
            return
        row = int((~finite).argmax())
        # The time of a row whose stamp is none is that of the last one that has one.
        before = recording.stamps[: row + 1]
        known = before[np.isfinite(before)]
        time = float(known[-1]) if known.size else 0.0
        what = "the stamp"
        for name, numbers in (("height", recording.heights), ("velocity", recording.velocities)):
            if numbers is not None and not np.isfinite(numbers[row]).all():
                slider = int((~np.isfinite(numbers[row])).argmax())
                what = f"the {name} of slider {slider + 1}"
        text = f"{what} is not a finite number"
        count = int((~finite).sum())
        self._violations.append(Violation(Kind.NOT_FINITE, time, np.nan, np.nan, count, time, text))

    def look_at_stamps(self, longest: float, limits: SliderLimits, may_pause: bool) -> None:
        """Find stamps that go back, gaps, and velocities that are not those of the heights.

        Args:
            longest: gap that there may be [s].
            limits: of the sliders.
            may_pause: whether a gap is none where the sliders rest before it and behind it.
        """
        times, period = self._times, self._period
        if len(times) < 2:
            return
        newest = np.maximum.accumulate(times)
        steps = np.diff(times, prepend=times[0] - period)
        since = np.append(period, times[1:] - newest[:-1])
        middle = float(np.median(steps[1:]))
        if not abs(middle - period) <= SAME_PERIOD * period:
            raise WrongPeriodError(middle, period)
        judged = ~self._begins
        self._note(
            Kind.ORDER,
            judged & (steps <= 0.0),
            -steps,
            0.0,
            lambda row: (
                f"the stamp is {_milliseconds(abs(steps[row]))} before that of the setpoint "
                "before it, must be after it"
            ),
        )
        # Stamps are rounded to nanoseconds.
        is_late = since > longest + 1e-9
        follows = np.zeros(len(times), dtype=bool)
        is_missing = np.zeros(len(times), dtype=bool)
        if self._velocities is not None:
            follows, is_missing = self._check_velocities(self._velocities, since, limits, is_late)
        resting = self._resting()
        is_pause = is_late & resting & np.roll(resting, 1) if may_pause else np.zeros_like(is_late)
        gaps = judged & ~is_pause & (is_late | is_missing)
        # A late setpoint that goes on where the one before it was is compared with it.
        self._begins |= is_pause | is_missing | (is_late & ~follows)
        inner = since[judged & ~is_pause]
        self._longest_gap = float(inner.max(initial=0.0))

        def gap_text(row: int) -> str:
            gap = _milliseconds(since[row])
            if is_missing[row]:
                return f"setpoints are missing: the heights go on by {gap} from one to the next"
            return f"{gap} without a setpoint, at most {_milliseconds(longest)}"

        self._note(Kind.GAP, gaps, since, longest, gap_text)

    def _resting(self) -> Rows:
        """Return in which rows nothing moves."""
        if self._velocities is not None:
            return np.asarray((np.abs(self._velocities) <= self._slowest).all(axis=1))
        # Beside a pause, one of the two neighbours tells.
        steps = np.abs(np.diff(self._heights, axis=0))
        same = (steps <= self._slowest * self._period).all(axis=1)
        return np.append(False, same) | np.append(same, False)

    def _check_velocities(
        self, velocities: FloatArray, since: FloatArray, limits: SliderLimits, is_late: Rows
    ) -> tuple[Rows, Rows]:
        """Compare published velocities with differences of the heights.

        Over a time T the way differs from T times the mean of both velocities by jerk T^3 / 12 at
        most, whatever the motion: the error of the trapezoidal rule.

        Returns:
            Whether each row follows the one before it after one period; whether it follows after
            several. Shapes (n,).
        """
        period, jerks = self._period, np.array(limits.jerk)
        ways = np.diff(self._heights, axis=0)
        means = 0.5 * (velocities[1:] + velocities[:-1])
        rounding = 2.0 * self._rounding

        def errors(count: NDArray[np.int64] | int) -> FloatArray:
            return np.abs(ways - np.asarray(count)[..., np.newaxis] * period * means)

        def bounds(count: NDArray[np.int64] | int) -> FloatArray:
            times = np.asarray(count)[..., np.newaxis] * period
            fastest = np.spacing(np.abs(velocities).max()) * ROUNDING_STEPS
            cubes = jerks * times**3 / 12.0 * (1.0 + LIMIT_TOLERANCE)
            return np.asarray(cubes + rounding + fastest * times)

        single = errors(1)
        follows = np.append(False, (single <= bounds(1)).all(axis=1))
        is_missing = np.zeros(len(follows), dtype=bool)
        # Only a stamp that is late tells of a setpoint before it; and one period has to be no
        # explanation for the way, not even with the bound of several.
        guess = np.rint(since[1:] / period).astype(np.int64)
        for more in (0, -1, 1):
            count = np.maximum(guess + more, 2)
            several = bounds(count)
            fits = (errors(count) <= several).all(axis=1) & (single > several).any(axis=1)
            is_missing[1:] |= fits & (since[1:] > LATE * period)
        wrong = ~follows & ~is_missing & ~is_late & ~self._begins
        differences = np.zeros((len(follows), 3))
        differences[1:] = single / period
        allowed = bounds(1) / period
        worst = (differences / allowed).max(axis=1)

        def text(row: int) -> str:
            slider = int((differences[row] / allowed).argmax())
            return (
                f"of slider {slider + 1} the published velocities differ from that of the heights "
                f"by {number_text(differences[row, slider])} m/s, at most "
                f"{number_text(allowed[slider])} m/s"
            )

        self._note(Kind.PUBLISHED_VELOCITY, wrong, worst, 1.0, text)
        return follows, is_missing

    def look_at_heights(self, workspace: Workspace, limits: SliderLimits) -> None:
        """Compare differences of the heights, and the places, with their limits."""
        count = len(self._times)
        uses, places = np.zeros((count, 3)), np.full((count, 4), -np.inf)
        values, sliders = np.zeros((count, 3)), np.zeros((count, 3), dtype=np.int8)
        for rows, fresh in self._blocks():
            heights = self._heights[rows]
            stream = CommandStream.from_heights(heights, self._period, self._resolution)
            parts = LimitUse.of(stream, limits, self._begins[rows]).parts[fresh:]
            new = slice(rows.start + fresh, rows.stop)
            uses[new] = parts.max(axis=2)
            sliders[new] = parts.argmax(axis=2)
            derivatives = np.stack((stream.velocities, stream.accelerations, stream.jerks), axis=1)
            worst = sliders[new][..., np.newaxis].astype(np.intp)
            values[new] = np.take_along_axis(derivatives[fresh:], worst, axis=2)[..., 0]
            found = overruns(workspace.machine, workspace.limits, heights[fresh:])
            places[new] = np.stack(found, axis=1)
        velocity, acceleration, jerk = uses.max(axis=0, initial=0.0).tolist()
        self._largest = (velocity, acceleration, jerk)
        kinds = (Kind.VELOCITY, Kind.ACCELERATION, Kind.JERK)
        for index, (kind, (quantity, unit)) in enumerate(zip(kinds, QUANTITIES)):

            def text(row: int, index: int = index, what: str = quantity, unit: str = unit) -> str:
                slider = int(sliders[row, index])
                return (
                    f"the {what} of slider {slider + 1} is {values[row, index]:.9g} {unit}, "
                    f"{uses[row, index]:.6f} of its limit, "
                    f"{number_text(limits.table[index, slider])} {unit}"
                )

            use = uses[:, index]
            self._note(kind, ~(use <= 1.0 + LIMIT_TOLERANCE), use, 1.0, text)
        for index, (kind, most) in enumerate(
            zip((Kind.TRAVEL, Kind.REACH, Kind.PLACE, Kind.CONDITION), OVERRUN_TOLERANCES)
        ):
            tolerance = most + (self._resolution if kind is Kind.TRAVEL else 0.0)
            over = places[:, index]
            self._note(
                kind,
                ~(over <= tolerance),
                over,
                tolerance,
                lambda row: _outside(workspace, self._heights[row]),
            )

    def look_at_added(self, bound: AddedBound) -> None:
        """Compare what the heights use of an added ``bound`` with it."""

        def seen(rows: slice) -> SeenParts:
            return bound.seen(self._heights[rows], self._period, self._rounding)

        parts = np.zeros(len(self._times))
        tolerance = 0.0
        for start in range(0, len(parts), BLOCK):
            # With a row before and one after.
            rows = slice(max(start - 1, 0), start + BLOCK + 1)
            found, tolerance, _ = seen(rows)
            parts[start : start + BLOCK] = found[start - rows.start :][:BLOCK]
        joined = ~self._begins
        if bound.order == 2:
            joined &= ~np.append(self._begins[1:], True)
        # Without a pose, the place is noted already.
        parts[~joined | ~np.isfinite(parts)] = 0.0
        kind = Kind(bound.quantity)
        self._added[kind] = float(parts.max(initial=0.0))
        wrong = parts > 1.0 + max(tolerance, LIMIT_TOLERANCE)
        self._note(kind, wrong, parts, 1.0, lambda row: seen(slice(row - 1, row + 2)).text(1))

    @property
    def _slowest(self) -> float:
        """The speed that is no more than the rounding of a height in a period [m/s]."""
        return self._last_bits / self._period

    @property
    def _rounding(self) -> float:
        """By how much a height may be wrong [m]."""
        return self._last_bits + self._resolution

    @property
    def _last_bits(self) -> float:
        """By how much the largest height may be wrong in double precision [m]."""
        return float(ROUNDING_STEPS * np.spacing(np.abs(self._heights).max(initial=0.0)))

    def _blocks(self) -> Iterator[tuple[slice, int]]:
        """Yield blocks of rows, each with some of those before it, and how many these are."""
        for start in range(0, len(self._times), BLOCK):
            first = max(start - ROWS_BEFORE, 0)
            yield slice(first, min(start + BLOCK, len(self._times))), start - first

    def _note(
        self,
        kind: Kind,
        wrong: Rows,
        values: FloatArray,
        bound: float,
        text: Callable[[int], str],
    ) -> None:
        """Note what is wrong in some rows, about the one with the largest value."""
        rows = np.flatnonzero(wrong)
        if not rows.size:
            return
        # A value that is not finite counts as the largest.
        worst = int(rows[values[rows].argmax()])
        first, time = float(self._times[rows[0]]), float(self._times[worst])
        value = float(values[worst])
        self._violations.append(Violation(kind, time, value, bound, len(rows), first, text(worst)))

    def judgement(self) -> Judgement:
        """Return all that was found."""
        times = self._times
        duration = float(times.max() - times.min()) if len(times) else 0.0
        beginnings = int(self._begins.sum())
        last = np.zeros(3)
        if self._velocities is not None:
            last = self._velocities[-1:]
        elif len(times) > 1 and not self._begins[-1]:
            last = np.diff(self._heights[-2:], axis=0) / self._period
        speed = float(np.abs(last).max(initial=0.0))
        speed = speed if speed > self._slowest else 0.0
        return Judgement(
            self._rows,
            duration,
            beginnings,
            self._largest,
            self._added,
            self._longest_gap,
            speed,
            tuple(self._violations),
        )


def _outside(workspace: Workspace, heights: FloatArray) -> str:
    """Return why heights are outside, in the words of the workspace."""
    try:
        workspace.check_heights(heights.tolist())
    except KinematicsError as error:
        return str(error)
    return "outside the workspace"


def _milliseconds(time: float) -> str:
    return f"{1e3 * float(time):.3f} ms"
