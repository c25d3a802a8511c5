"""Numbers that lead nowhere are no plan: they refuse a command, and end nothing else."""

from __future__ import annotations

from types import TracebackType

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.trajectory.errors import PlanningError


class _Sound:
    """A context in which absurd numbers are an error of planning."""

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        _: TracebackType | None,
    ) -> None:
        """Raise a ``PlanningError`` in place of what absurd numbers raise."""
        if isinstance(error, (ArithmeticError, ValueError, IndexError)) and not isinstance(
            error, KinematicsError
        ):
            text = f"the numbers of the motion lead nowhere: {error}"
            raise PlanningError(text) from error


SOUND = _Sound()
