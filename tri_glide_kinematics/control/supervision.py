"""Compares what the sliders are measured to do with what they were told. No ROS in here."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tri_glide_kinematics.control.operating_state import Cause, Reason
from tri_glide_kinematics.wording import number_text

# The machine is silent only if it says nothing while we listen: after a late cycle of our own the
# messages that came in meanwhile are read first.
SILENT_CYCLES = 3


@dataclass(frozen=True)
class SupervisionBounds:
    """How far measured heights may differ from what is expected.

    Attributes:
        timeout: longest time between two measurements [s].
        jump: largest change between two measurements, beyond the velocity limit times the time
            between them [m].
        tracking_error: largest distance between measured and commanded height [m].
        velocity: largest velocity of each slider. Shape (3,) [m/s].
    """

    timeout: float
    jump: float
    tracking_error: float
    velocity: Sequence[float]


class Supervisor:
    """Watches the measured heights; each method returns the reason of a fault, or None.

    Attributes:
        bounds: how far the heights may differ from what is expected.
        tracking_error: largest distance of a slider from its command, latest measurement [m].
    """

    def __init__(
        self,
        bounds: SupervisionBounds,
        joint_names: Sequence[str],
        senders: Callable[[], Sequence[str]] = tuple,
    ) -> None:
        """Watch the sliders of these names; ``senders`` returns who sends measured heights."""
        self.bounds = bounds
        self.tracking_error = 0.0
        self._names = tuple(joint_names)
        self._senders = senders
        self._heights: Sequence[float] | None = None
        self._time = -math.inf
        self._stamp = 0.0
        self._silent_cycles = 0

    def restart(self) -> None:
        """Forget all measurements: the next one is no jump."""
        self._heights = None
        self._silent_cycles = 0

    def is_fresh(self, now: float) -> bool:
        """Tell whether there is a measurement that is not older than the timeout."""
        return now - self._time <= self.bounds.timeout

    def measured(
        self,
        heights: Sequence[float],
        commanded: Sequence[float] | None,
        now: float,
        stamp: float = 0.0,
    ) -> Reason | None:
        """Take in a measurement.

        Measurements that waited in a queue come in faster than they were made; so the time that
        passed between two of them is the longer one of those by receipt and by stamp.

        Args:
            heights: measured. Shape (3,) [m].
            commanded: latest command, None while there is none. Shape (3,) [m].
            now: time of receipt by a steady clock [s].
            stamp: time of the measurement by the sender's clock, 0 if it has none [s].
        """
        last, self._heights = self._heights, heights
        elapsed, self._time = now - self._time, now
        stamped, self._stamp = stamp - self._stamp, stamp
        if elapsed < stamped <= self.bounds.timeout:
            elapsed = stamped
        self._silent_cycles = 0
        for name, height in zip(self._names, heights):
            if not math.isfinite(height):
                self._heights = None
                return Reason(
                    Cause.MEASUREMENT_NOT_FINITE,
                    f"measured height of {name} is {height}, not a finite number",
                )
        if last is not None:
            for slider, name in enumerate(self._names):
                change = heights[slider] - last[slider]
                allowed = self.bounds.jump + self.bounds.velocity[slider] * elapsed
                if abs(change) > allowed:
                    senders = self._senders()
                    mixed = f"; {' and '.join(senders)} send heights" if len(senders) > 1 else ""
                    return Reason(
                        Cause.MEASUREMENT_JUMP,
                        f"measured height of {name} jumped by {number_text(change, 6)} m in "
                        f"{number_text(elapsed, 3)} s, more than {number_text(allowed, 6)} m"
                        + mixed,
                    )
        if commanded is None:
            return None
        errors = [abs(height - command) for height, command in zip(heights, commanded)]
        self.tracking_error = max(errors)
        if self.tracking_error > self.bounds.tracking_error:
            slider = errors.index(self.tracking_error)
            return Reason(
                Cause.TRACKING_ERROR,
                f"{self._names[slider]} is measured at {number_text(heights[slider], 6)} m, but "
                f"commanded to {number_text(commanded[slider], 6)} m: "
                f"{number_text(errors[slider], 6)} m apart, more than "
                f"{number_text(self.bounds.tracking_error, 6)} m",
            )
        return None

    def cycle(self, now: float) -> Reason | None:
        """Look whether the measurements have gone silent; to be called in each control cycle."""
        silence = now - self._time
        if silence <= self.bounds.timeout:
            self._silent_cycles = 0
            return None
        self._silent_cycles += 1
        if self._silent_cycles < SILENT_CYCLES:
            return None
        return Reason(
            Cause.MEASUREMENTS_SILENT,
            f"measured heights are silent for {number_text(silence, 3)} s, more than "
            f"{number_text(self.bounds.timeout, 3)} s",
        )
