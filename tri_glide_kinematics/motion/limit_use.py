"""How much of their limits commanded sliders use, by finite differences of the heights alone.

That is what a drive sees: the judgement knows nothing of the plans behind the heights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import array_of_shape, non_negative, positive
from tri_glide_kinematics.motion.limits import QUANTITIES, SliderLimits
from tri_glide_kinematics.vectors import FloatArray


@dataclass(frozen=True, eq=False)
class CommandStream:
    """Commanded heights, one row after each period, with their finite differences.

    Row k of ``velocities`` is the mean over the period that ends at row k of ``heights``, and
    likewise further down; the first rows, which have too few predecessors, are zero.

    Attributes:
        times: Shape (n,) [s], from zero.
        heights: Shape (n, 3) [m].
        velocities: Shape (n, 3) [m/s].
        accelerations: Shape (n, 3) [m/s^2].
        jerks: Shape (n, 3) [m/s^3].
        roundings: by how much velocity, acceleration and jerk may be wrong at most, as the heights
            are rounded; the jerk the most, as it has them divided by the cube of the period.
            Shape (n, 3) [m/s, m/s^2, m/s^3].
    """

    times: FloatArray
    heights: FloatArray
    velocities: FloatArray
    accelerations: FloatArray
    jerks: FloatArray
    roundings: FloatArray

    @classmethod
    def from_heights(
        cls, heights: ArrayLike, period: ArrayLike, resolution: float = 0.0
    ) -> CommandStream:
        """Differentiate ``heights`` that are a ``period`` apart.

        A difference of order k is k! times the divided difference, so whatever the periods are it
        is a mean of the derivative of that order: it keeps each limit that the derivative keeps.

        Args:
            heights: Shape (n, 3) [m].
            period: between two rows; or before each row, where the first is not used: shape (n,)
                [s].
            resolution: by how much a height may be wrong, beside the rounding of numbers in double
                precision: a half of its last digit, where the heights come from a text [m].

        Raises:
            WrongShapeError: if ``heights`` or ``period`` has another shape.
            OutOfBoundsError: if a ``period`` is not positive, or the ``resolution`` negative.
        """
        rows = array_of_shape("heights", heights, (None, 3))
        rounding = non_negative("resolution", resolution, "m") + ROUNDING_STEPS * np.spacing(
            np.abs(rows[np.isfinite(rows)]).max(initial=0.0)
        )
        count = len(rows)
        if np.ndim(period) == 0:
            periods = np.full(count, positive("period", float(np.asarray(period)), "s"))
            times = periods * np.arange(count, dtype=np.float64)
        else:
            periods = array_of_shape("period", period, (count,))
            if count > 1:
                positive("period", periods[1:].min(), "s")
            times = np.asarray(np.cumsum(periods) - periods[:1], dtype=np.float64)
        derivatives: list[FloatArray] = [rows]
        roundings = np.zeros((count, 3))
        wrong = np.full(count, rounding)
        spans = np.zeros(count)
        for order in (1, 2, 3):
            # Before row k lie the last ``order`` periods.
            spans = periods[order:] + spans[:-1] if order > 1 else periods[1:]
            derivative = np.zeros(rows.shape)
            change = np.diff(derivatives[-1][order - 1 :], axis=0)
            derivative[order:] = order * change / spans[:, np.newaxis]
            derivatives.append(derivative)
            wrong = order * (wrong[1:] + wrong[:-1]) / spans
            roundings[order:, order - 1] = wrong
        _, velocities, accelerations, jerks = derivatives
        return cls(times, rows, velocities, accelerations, jerks, roundings)

    def part(self, first: int, end: int) -> CommandStream:
        """Return the rows from ``first`` up to but not including ``end``."""
        rows = slice(first, end)
        return CommandStream(
            self.times[rows],
            self.heights[rows],
            self.velocities[rows],
            self.accelerations[rows],
            self.jerks[rows],
            self.roundings[rows],
        )


# Heights are as exact as so many steps of numbers in double precision of the size of the largest.
ROUNDING_STEPS = 4.0

# Differences of velocity, acceleration and jerk may pass a limit by this part of it, beside what
# the rounding of the heights makes of them.
LIMIT_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class LimitUse:
    """Velocity, acceleration and jerk of a stream of commands as parts of their limits.

    Attributes:
        parts: magnitude over limit, by row, quantity and slider, without what may come of the
            rounding of the heights; zero where a difference has too few rows before it.
            Shape (n, 3, 3).
    """

    parts: FloatArray

    @classmethod
    def of(
        cls,
        stream: CommandStream,
        limits: SliderLimits | ArrayLike,
        begins: ArrayLike | None = None,
    ) -> LimitUse:
        """Compare all differences of ``stream`` with ``limits``.

        Args:
            stream: of n rows.
            limits: of all rows, or of velocity, acceleration and jerk in the step that leads to
                each row: shape (n, 3, 3). A difference that spans several steps may be as large
                as the largest limit of these steps allows.
            begins: whether a row begins anew, so that the step that leads to it is not judged.
                Shape (n,).

        Raises:
            WrongShapeError: if ``limits`` or ``begins`` has another shape.
        """
        count = len(stream.heights)
        if isinstance(limits, SliderLimits):
            table = np.broadcast_to(limits.table, (count, 3, 3))
        else:
            table = array_of_shape("limits", limits, (count, 3, 3))
        anew = np.zeros(count) if begins is None else begins
        anew = array_of_shape("begins", anew, (count,)).astype(bool)
        parts = np.zeros((count, 3, 3))
        derivatives = (stream.velocities, stream.accelerations, stream.jerks)
        for order, derivative in enumerate(derivatives, start=1):
            steps = np.arange(order, count)[:, np.newaxis] - np.arange(order)
            allowed = table[steps, order - 1].max(axis=1)
            judged = ~anew[steps].any(axis=1)[:, np.newaxis]
            sure = np.abs(derivative[order:]) - stream.roundings[order:, order - 1, np.newaxis]
            use = np.maximum(sure, 0.0) / allowed
            parts[order:, order - 1] = np.where(judged, use, 0.0)
        return cls(parts)

    def part(self, first: int, end: int) -> LimitUse:
        """Return the rows from ``first`` up to but not including ``end``."""
        return LimitUse(self.parts[first:end])

    @property
    def largest(self) -> FloatArray:
        """Largest part of the limits of velocity, acceleration and jerk. Shape (3,)."""
        return np.asarray(self.parts.max(axis=(0, 2), initial=0.0))

    @property
    def is_within(self) -> bool:
        """Whether all limits are kept, to rounding."""
        return are_within(self.largest)

    def violations(self, first: int = 0) -> list[str]:
        """Return a text for each quantity that passes a limit, about where it does so most.

        Args:
            first: number of the first row, for the texts.
        """
        texts = []
        for index, (quantity, _) in enumerate(QUANTITIES):
            parts = self.parts[:, index]
            if not (parts <= 1.0 + LIMIT_TOLERANCE).all():
                # A number that is not finite counts as the largest.
                row, slider = np.unravel_index(int(parts.argmax()), parts.shape)
                texts.append(
                    f"{quantity} of slider {slider + 1} is {parts[row, slider]:.9f} of its limit "
                    f"in row {first + row}"
                )
        return texts


def are_within(largest: ArrayLike) -> bool:
    """Return whether largest parts of velocity, acceleration and jerk (shape (3,)) keep limits."""
    return bool((np.asarray(largest) <= 1.0 + LIMIT_TOLERANCE).all())
