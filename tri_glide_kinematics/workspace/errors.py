"""Errors for a place outside the workspace."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.wording import number_text, unit_question, vector_text

if TYPE_CHECKING:
    from tri_glide_kinematics.workspace.limits import WorkspaceLimit


class OutsideWorkspaceError(KinematicsError):
    """A place breaks a limit of the workspace."""

    refusal = Refusal.OUTSIDE_WORKSPACE

    def __init__(
        self,
        limit: WorkspaceLimit,
        arm: int | None,
        position: Sequence[float],
        value: float,
        bound: float,
    ) -> None:
        """Store which limit is broken, and where.

        Args:
            limit: that is broken.
            arm: index of the arm (and slider), if the limit belongs to one.
            position: of the platform [m].
            value: of the limited quantity, in the limit's unit.
            bound: that it breaks.
        """
        of_arm = "" if arm is None else f" of arm {arm + 1}"
        unit = f" {limit.unit}" if limit.unit else ""
        question = unit_question(value, bound) if limit.unit else ""
        super().__init__(
            f"outside the workspace at {vector_text(position)} m: {number_text(value)}{unit} "
            f"breaks the {limit.value}{of_arm}, {number_text(bound)}{unit}{question}"
        )
        self.limit = limit
        self.arm = arm
        self.position = tuple(position)
        self.value = value
        self.bound = bound
