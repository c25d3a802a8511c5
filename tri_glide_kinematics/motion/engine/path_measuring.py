"""The length of the path that is followed, worked out in pieces while the platform moves on it."""

from __future__ import annotations

from collections.abc import Callable

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.path.arc_length import ArcLength
from tri_glide_kinematics.motion.path.driven_path import DrivenPath


class PathMeasuring:
    """Measures one path after the other; the motion does not need their lengths."""

    def __init__(self) -> None:
        """Begin with none."""
        self._under_way: tuple[DrivenPath, Interruptible[ArcLength]] | None = None

    def work(self, driven: DrivenPath | None, may_go_on: Callable[[], bool]) -> None:
        """Go on with the length of a path, unless it is known, while ``may_go_on``."""
        if driven is None or driven.is_measured:
            self._under_way = None
            return
        if self._under_way is None or self._under_way[0] is not driven:
            self._under_way = driven, driven.measured()
        _, measuring = self._under_way
        for _ in measuring:
            if not may_go_on():
                return
