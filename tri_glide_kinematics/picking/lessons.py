"""What was touched and seen so far to teach a cell: each thing is solved when there is enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from tri_glide_kinematics.picking.teaching import (
    NotEnoughError,
    Observed,
    TaughtBelt,
    TaughtCamera,
    TaughtGripper,
    TaughtLatency,
    teach_belt,
    teach_camera,
    teach_gripper,
    teach_latency,
)
from tri_glide_kinematics.vectors import Vector3

Item = TypeVar("Item")
Taught = TypeVar("Taught")


class Lessons:
    """Touches and views, by what they teach.

    One that contradicts those before is not kept. Where it was those that were wrong, begin anew.
    """

    def __init__(self) -> None:
        """Know none yet."""
        self._marks: list[tuple[Vector3, Vector3]] = []
        self._touches: list[Observed] = []
        self._views: list[Observed] = []
        self._parts: dict[str, list[tuple[Observed, Observed]]] = {}

    def mark(self, mark: Vector3, platform: Vector3) -> TaughtGripper:
        """Take in where the platform is while the gripper's point touches a known ``mark`` [m].

        Raises:
            TeachingError: if that is not enough, or does not fit.
        """
        return _solved(self._marks, [(mark, platform)], teach_gripper)

    def belt(self, touch: Observed) -> TaughtBelt:
        """Take in a ``touch`` of the mark on the belt.

        Raises:
            TeachingError: if that is not enough, or does not fit.
        """
        return _solved(self._touches, [touch], teach_belt)

    def latency(self, views: Sequence[Observed], belt: TaughtBelt) -> TaughtLatency:
        """Take in ``views`` of a part at one speed of the ``belt``, which was taught before.

        Raises:
            TeachingError: if that is not enough, or does not fit.
        """
        return _solved(self._views, views, lambda all_: teach_latency(all_, belt))

    def part(
        self, camera: str, view: Observed, touch: Observed, belt: TaughtBelt, latency: float
    ) -> TaughtCamera:
        """Take in a part that a ``camera`` has seen, and that was touched.

        Args:
            camera: its frame.
            view: as it was seen.
            touch: as it was touched, there or farther along the belt.
            belt: taught before.
            latency: of the camera [s].

        Raises:
            TeachingError: if that is not enough, or does not fit.
        """
        kept = self._parts.setdefault(camera, [])
        return _solved(kept, [(view, touch)], lambda all_: teach_camera(all_, belt, latency))


def _solved(
    kept: list[Item], new: Sequence[Item], solve: Callable[[Sequence[Item]], Taught]
) -> Taught:
    """Solve with ``new`` observations, and keep them if they fit."""
    try:
        taught = solve([*kept, *new])
    except NotEnoughError:
        kept.extend(new)
        raise
    kept.extend(new)
    return taught
