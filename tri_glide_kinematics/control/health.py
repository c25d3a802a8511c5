"""The health of a node: how well it does its work, in a level, a line and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

from tri_glide_kinematics.control.loop_statistics import CLASSES, LoopStatistics
from tri_glide_kinematics.control.operating_state import (
    DISABLED,
    FAULT,
    MOVING,
    PAUSED,
    WAITING,
    ControllerStatus,
    OperatingState,
)
from tri_glide_kinematics.reason_log import ReasonLog

if TYPE_CHECKING:
    from tri_glide_kinematics.control.controller import MotionController
    from tri_glide_kinematics.control.supervision import Supervisor


class Level(IntEnum):
    """Levels as in ``diagnostic_msgs/DiagnosticStatus`` and REP 107."""

    OK = 0  # does its work
    WARN = 1  # does its work, but somebody should look
    ERROR = 2  # does not do its work
    STALE = 3  # has no data yet


class Health(NamedTuple):
    """What a node says about itself.

    Attributes:
        level: how well it does its work.
        message: one line.
        values: numbers behind it.
    """

    level: Level
    message: str
    values: Mapping[str, object]


# More late cycles than this part of all are worth a look.
TOO_MANY_LATE = 0.05

LEVELS = {WAITING: Level.WARN, DISABLED: Level.WARN, FAULT: Level.ERROR}


def told_state(state: OperatingState) -> OperatingState:
    """Return the state as texts name it: standard tools know a pause as a motion."""
    return MOVING if state is PAUSED else state


def line_of(status: ControllerStatus) -> str:
    """Return state and reason in a line."""
    return f"{told_state(status.state).value}: {status.reason}"


def status_of(status: ControllerStatus, refused: ReasonLog, remark: str = "") -> Health:
    """Return state, reason, newest target and last refusal, as they are latched on ``~/status``.

    A ``remark`` is something beside the state that somebody should know; empty for none.
    """
    level = LEVELS.get(status.state, Level.OK)
    if status.target_missed or remark:
        level = max(level, Level.WARN)
    return Health(
        level,
        line_of(status),
        {
            "state": told_state(status.state).name.lower(),
            "reason": status.reason.text,
            "newest target": status.newest_target,
            "refused commands": refused.total,
            "last refusal": refused.last,
            "remark": remark,
        },
    )


def health_of(
    controller: MotionController,
    supervisor: Supervisor,
    loop: LoopStatistics,
    refused: ReasonLog,
    unusable: int,
    remark: str = "",
    continuous_forces: Sequence[float] | None = None,
) -> Health:
    """Return the health of the last second.

    Args:
        controller: state and reason.
        supervisor: tracking error.
        loop: intervals of the control loop since the last call.
        refused: commands that were refused.
        unusable: measurements without a meaning in the last second.
        remark: something beside the state that somebody should know; empty for none.
        continuous_forces: of the sliders. Shape (3,) [N]; None where none are known.
    """
    timing = loop.report()
    refused_now = refused.end_of_second()
    level, message, values = status_of(controller.status, refused, remark)
    warnings = []
    if timing.late_cycles > TOO_MANY_LATE * timing.rate:
        warnings.append(f"{timing.late_cycles} late cycles")
    if timing.stalls:
        delay = 1000.0 * timing.largest_delay
        warnings.append(f"a cycle late by more than five periods, by {delay:.3g} ms")
    if refused_now:
        warnings.append(f"{refused_now} refused commands")
    if unusable:
        warnings.append(f"{unusable} unusable measurements")
    if warnings:
        level = max(level, Level.WARN)
        message = f"{message} ({', '.join(warnings)} in the last second)"
    return Health(
        level,
        message,
        {
            **values,
            "loop rate [1/s]": timing.rate,
            "jitter, root mean square [s]": timing.jitter,
            "largest delay of a cycle [s]": timing.largest_delay,
            "late cycles in the last second": timing.late_cycles,
            "late cycles": loop.total_late,
            **delay_counts(loop),
            "largest delay of a cycle since the start [s]": loop.longest_delay,
            "refused commands in the last second": refused_now,
            "unusable measurements in the last second": unusable,
            "tracking error [m]": supervisor.tracking_error,
            "distance from the moving target [m]": controller.tracking_distance,
            "duration of the shaper [s]": controller.shaper_duration,
            **{
                f"continuous force of slider {index} [N]": force
                for index, force in enumerate(continuous_forces or (), start=1)
            },
        },
    )


def delay_counts(loop: LoopStatistics) -> dict[str, int]:
    """Return how many cycles were how late since the start."""
    lower = ("", *(f"{end:g} to " for end in CLASSES[:-1]))
    names = [f"{begin or 'up to '}{end:g} periods" for begin, end in zip(lower, CLASSES)]
    names.append("more than five periods")
    return {f"cycles late by {name}": count for name, count in zip(names, loop.histogram)}
