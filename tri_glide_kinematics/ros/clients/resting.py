"""Lets services wait until the sliders rest, while their node goes on."""

from __future__ import annotations

import time

from rclpy.task import Future

from tri_glide_kinematics.calibration.session.errors import RecordingError
from tri_glide_kinematics.calibration.session.height_record import HeightRecord

# Who asks right after a motion has to wait for the time of rest that is asked for [s].
LONGEST_WAIT = 1.0


class Resting:
    """Gives resting heights to those who wait for them."""

    def __init__(self, record: HeightRecord) -> None:
        """Look at a ``record`` of heights."""
        self._record = record
        self._waiting: list[tuple[float, Future]] = []

    def heights(self) -> Future:
        """Return what will hold the resting heights, or a RecordingError that says why not."""
        future = Future()
        self._waiting.append((time.monotonic() + LONGEST_WAIT, future))
        return future

    def step(self) -> None:
        """Answer those who can be answered; to be called again and again."""
        if not self._waiting:
            return
        now = time.monotonic()
        waiting, self._waiting = self._waiting, []
        try:
            heights = self._record.resting(now)
        except RecordingError as error:
            for end, future in waiting:
                if now < end:
                    self._waiting.append((end, future))
                else:
                    future.set_exception(error)
            return
        for _, future in waiting:
            future.set_result(heights)
