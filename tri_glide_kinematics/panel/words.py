"""The words of the page: what ``ik_node`` tells about itself, and pieces of HTML around them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import TEACH_SPEED, Cause, OperatingState
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.messages import vector_of
from tri_glide_kinematics.ros.outputs import cause_of, state_of
from tri_glide_kinematics.settings import Values
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text
from tri_glide_kinematics.workspace import OutsideWorkspaceError, Workspace

# What ``ik_node`` tells about itself, in the words and the unit of the page: millimetres.
#
# ``ik_node`` writes its own texts in metres, as those of the topics are. They are never read here:
# all words are made from the numbers of ``MachineState``.

READY, MOTION, WARNING, FAULT = "ready", "motion", "warning", "fault"

COLORS = {
    OperatingState.IDLE: READY,
    OperatingState.MOVING: MOTION,
    OperatingState.JOGGING: MOTION,
    OperatingState.TRACKING: MOTION,
    OperatingState.STOPPING: WARNING,
    OperatingState.WAITING: WARNING,
    OperatingState.DISABLED: WARNING,
    OperatingState.PAUSED: WARNING,
    OperatingState.FAULT: FAULT,
}

# Of a cause: {target} is the newest target, {distance} what is measured from it, and a name in
# capital letters a parameter of ik_node.
CAUSES = {
    Cause.COMMAND: "{target}",
    Cause.SLOW_STREAM: "{target}; its messages come more slowly than their timeout",
    Cause.EDGE: "{target}; the platform is held at the edge of the workspace",
    Cause.PAUSE_ASKED: "pause was asked for; {target}",
    Cause.TARGET_REACHED: "{target} is reached",
    Cause.TARGET_NOT_REACHED: "measured {distance} from the target, more than {POSITION_TOLERANCE}",
    Cause.TARGET_TOO_FAR: "measured {distance} from the target, more than {POSITION_ERROR_LIMIT}",
    Cause.TARGET_REFUSED: "{target}: the way there is blocked",
    Cause.STOP_ASKED: "a stop was asked for",
    Cause.DISABLE_ASKED: "somebody has disabled it",
    Cause.ENABLE_ASKED: "somebody has enabled it",
    Cause.CANCELLED: "the motion was cancelled",
    Cause.RELEASED: "the jog has ended",
    Cause.TWISTS_SILENT: "no twist came for {TWIST_TIMEOUT}",
    Cause.TARGETS_SILENT: "the moving target is silent for {TARGET_TIMEOUT}",
    Cause.STARTED_DISABLED: "it was started disabled",
    Cause.NO_MEASUREMENT: "no heights of the sliders are measured yet",
    Cause.MEASUREMENT: "the first measured heights came",
    Cause.LOOKING_FOR_OTHERS: "ik_node looks for other publishers of setpoints",
    Cause.OTHER_PUBLISHER: "another node publishes setpoints for this machine",
    Cause.MEASUREMENTS_SILENT: "no measured heights for {MEASURED_TIMEOUT}",
    Cause.MEASUREMENT_JUMP: "a measured height jumped by more than {JUMP_LIMIT}",
    Cause.MEASUREMENT_NOT_FINITE: "a measured height is no number",
    Cause.TRACKING_ERROR: "a slider is measured farther than {TRACKING_ERROR_LIMIT} from its "
    "setpoint",
    Cause.PROGRAM_ERROR: "an error inside ik_node, which ends",
    Cause.NODE_ENDS: "ik_node ends",
    Cause.PROGRAM_LOST: "what drove a program is gone: it told nothing for {PROGRAM_TIMEOUT}",
}

REFUSALS = {
    MachineState.REFUSAL_NOT_FINITE: "a number is NaN or infinite",
    MachineState.REFUSAL_OUT_OF_BOUNDS: "a number has a value that is not allowed",
    MachineState.REFUSAL_WRONG_FRAME: "its frame is not that of the machine",
    MachineState.REFUSAL_ROTATION: "the platform cannot rotate",
    MachineState.REFUSAL_STAMP: "its stamp is missing, or far from the clock of ik_node",
    MachineState.REFUSAL_MESSAGE: "the message contradicts itself",
    MachineState.REFUSAL_UNSUPPORTED: "ik_node as it is set up cannot do this",
    MachineState.REFUSAL_UNREACHABLE: "outside the workspace: the arms do not reach there",
    MachineState.REFUSAL_OUTSIDE_WORKSPACE: "the target or the way there is outside the workspace",
    MachineState.REFUSAL_NO_ROOM: "the platform is at the edge of the workspace",
    MachineState.REFUSAL_PATH: "the path is empty, has a segment that is too short, or no arc",
    MachineState.REFUSAL_NO_PLAN: "no motion was found that keeps all limits",
    MachineState.REFUSAL_WAITING: "not in the state waiting",
    MachineState.REFUSAL_FAULT: "not in the state fault: press enable",
    MachineState.REFUSAL_DISABLED: "not in the state disabled: press enable",
    MachineState.REFUSAL_STOPPING: "not before the ramp to rest is over",
    MachineState.REFUSAL_NOT_RELEASED: "after a stop, release first",
    MachineState.REFUSAL_NO_PATH: "no path is followed",
    MachineState.REFUSAL_NEWER_COMMAND: "a newer command is not begun yet",
    MachineState.REFUSAL_NO_MEASUREMENT: "no heights of the sliders are measured",
    MachineState.REFUSAL_OTHER_PUBLISHER: "another node publishes setpoints, or may do so",
    MachineState.REFUSAL_OUTSIDE_TRAVEL: "a slider is measured outside its travel",
}

# Unit in which a parameter of a cause is shown, and how many of it make 1 of SI.
UNITS = {"timeout": ("s", 1.0), "limit": ("mm", 1000.0), "tolerance": ("mm", 1000.0)}


def position_text(position: Vector3) -> str:
    """Return a ``position`` [m] for the strip."""
    parts = (f"{axis} {_signed(1000.0 * each, 2)}" for axis, each in zip("XYZ", position))
    return "  ".join((*parts, "mm"))


@dataclass(frozen=True)
class MachineStatus:
    """A message of ``~/machine_state``, or none so far."""

    message: MachineState = field(default_factory=MachineState)

    @property
    def state(self) -> OperatingState | None:
        """None before it has said anything, or if it is none that is known here."""
        return state_of(self.message)

    @property
    def cause(self) -> Cause | None:
        """Cause of the state; None likewise."""
        return cause_of(self.message)

    @property
    def word(self) -> str:
        """The state in a word; empty if it is not known."""
        state = self.state
        return "" if state is None else state.name.lower()

    @property
    def color(self) -> str:
        """The colour of the state."""
        state = self.state
        return WARNING if state is None else COLORS[state]

    def reason(self, values: Values) -> str:
        """Return why it is in this state, and a remark; ``values`` are ``ik_node``'s parameters."""
        cause = self.cause
        words = ""
        if cause is not None:
            bounds = {
                name.upper(): bound_text(name, value)
                for name, value in values.items()
                if isinstance(value, float) and name.rpartition("_")[2] in UNITS
            }
            distance = millimetres(self.message.target_distance)
            words = CAUSES[cause].format(target=self.target, distance=distance, **bounds)
        return "; ".join(filter(None, (words.removesuffix("; "), self.message.remark)))

    @property
    def target(self) -> str:
        """The newest target."""
        message = self.message
        place = place_text(vector_of(message.target))
        if message.target_kind == MachineState.TARGET_POSITION:
            return f"target {place}"
        if message.target_kind == MachineState.TARGET_VELOCITY:
            return f"velocity {place_text(vector_of(message.target_velocity))}/s"
        if message.target_kind == MachineState.TARGET_MOVING:
            return f"moving target {place}"
        if message.target_kind == MachineState.TARGET_PATH:
            return f"path to {place}"
        return ""

    @property
    def refusal(self) -> str:
        """Why the last command was refused, that was."""
        return f"refused: {REFUSALS.get(self.message.refusal, 'the log of ik_node says why')}"

    @property
    def place(self) -> Vector3 | None:
        """Where the setpoints are [m]; None if there are none."""
        numbers = vector_of(self.message.position)
        is_known = self.state is not None and math.isfinite(sum(numbers))
        return numbers if is_known else None

    @property
    def position(self) -> str:
        """Where the setpoints are, in words."""
        return "" if self.place is None else position_text(self.place)

    @property
    def speed(self) -> str:
        """How fast the setpoints move, and what changes that if anything does."""
        message = self.message
        if self.state is None or not math.isfinite(message.speed):
            return ""
        words = [f"{1000.0 * message.speed:.1f} mm/s"]
        for what, scale in (("speed", message.speed_scale), ("F", message.path_speed_scale)):
            if scale not in (0.0, 1.0):
                words.append(f"{what} {100.0 * scale:.0f} %")
        return " · ".join(words)

    @property
    def speed_limit(self) -> str:
        """Whether the teach mode is on, and how fast the platform may be if that is bounded."""
        limit = self.message.platform_speed_limit
        if self.state is None:
            return ""
        words = f"at most {number_text(1000.0 * limit, 6)} mm/s" if limit else ""
        if not self.message.teach_mode:
            return words
        # In motion, the limit is in force a moment later.
        return f"teach mode · {words if 0.0 < limit <= TEACH_SPEED else 'slows down'}"

    @property
    def left(self) -> str:
        """The way and the time to the end of what is done; empty where there is no end."""
        message = self.message
        is_path = message.target_kind == MachineState.TARGET_PATH
        words = []
        # Nothing is left to be told when all is done.
        if math.isfinite(message.way_remaining) and message.way_remaining > 0.0:
            words.append(f"{1000.0 * message.way_remaining:.1f} mm")
        if math.isfinite(message.time_remaining) and message.time_remaining > 0.0:
            words.append(clock_text(message.time_remaining))
        if self.state is None or not words:
            return ""
        segment = f"segment {message.segment + 1} · " if is_path else ""
        # A program, of which a path is a part, has another end.
        return f"{segment}{' · '.join(words)} left{' of this path' if is_path else ''}"


def outside_text(workspace: Workspace, place: Vector3) -> str | None:
    """Return which limit of a ``workspace`` a place [m] breaks; None if it is inside."""
    try:
        workspace.check_position(place)
    except OutsideWorkspaceError as error:
        scale, unit = (1000.0, " mm") if error.limit.unit == "m" else (1.0, "")
        of_arm = "" if error.arm is None else f" of arm {error.arm + 1}"
        value, bound = (f"{_rounded(scale * each)}{unit}" for each in (error.value, error.bound))
        return (
            f"{place_text(place)} is outside the workspace: {value} breaks the "
            f"{error.limit.value}{of_arm}, {bound}"
        )
    except KinematicsError:
        return f"{place_text(place)} is outside the workspace: the arms do not reach there"
    return None


def bound_text(name: str, value: float) -> str:
    """Return the value of a parameter with its unit, as the page writes it."""
    unit, scale = UNITS[name.rpartition("_")[2]]
    return f"{number_text(scale * value, 6)} {unit}"


def millimetres(length: float) -> str:
    """Return a length [m] as the page writes it."""
    return f"{_rounded(1000.0 * length)} mm"


def place_text(place: Iterable[float]) -> str:
    """Return a place [m] as the page writes it."""
    return f"({', '.join(_rounded(1000.0 * number) for number in place)}) mm"


def clock_text(duration: float) -> str:
    """Return a duration [s] as minutes and seconds, with hours if there are any."""
    minutes, seconds = divmod(math.ceil(duration), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes}:{seconds:02d}"


def _rounded(value: float) -> str:
    """Return a number with at most three digits behind the point."""
    return number_text(round(value, 3), 9) if math.isfinite(value) else "?"


def _signed(value: float, digits: int) -> str:
    """Return a number without a minus before zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


# Pieces of the page as HTML; ``page.css`` says how they look.


def note(text: str, *, is_bad: bool = False) -> str:
    """Return a text of its own."""
    return f'<div class="tri-glide-note{" bad" if is_bad else ""}">{escape(text)}</div>'


def code(text: str) -> str:
    """Return a line of a program."""
    return f'<div class="tri-glide-note tri-glide-code">{escape(text)}</div>' if text else ""


def table(rows: Iterable[Iterable[str]]) -> str:
    """Return a table; cells that begin with a tag are taken as they are."""
    return _table("".join(f"<td>{_cell(cell)}</td>" for cell in row) for row in rows)


def bar(part: float, *, is_much: bool = False) -> str:
    """Return a bar that is filled to a ``part`` of its length."""
    width = 100.0 * min(max(part, 0.0), 1.0)
    kind = ' class="much"' if is_much else ""
    return f'<div class="bar"><i{kind} style="width:{width:.0f}%"></i></div>'


def progress(part: float, words: str, *, is_work: bool = False) -> str:
    """Return a bar of what is done, with ``words`` below it.

    That of work of this computer moves all the time: it tells of the next part when it has time to.
    """
    shown = bar(part).replace('"bar"', '"bar works"') if is_work else bar(part)
    return table([(f"{100.0 * part:.0f} %", shown)]) + note(words)


def legend(colors: Iterable[Sequence[int]], least: str, largest: str) -> str:
    """Return a bar with ``colors`` from left to right, and what both of its ends mean."""
    stops = ", ".join(f"rgb({red} {green} {blue})" for red, green, blue in colors)
    ends = f"<span>{escape(least)}</span><span>{escape(largest)}</span>"
    return (
        f'<div class="tri-glide-legend"><i style="background:linear-gradient(90deg, {stops})"></i>'
        f"{ends}</div>"
    )


def _cell(text: str) -> str:
    return text if text.startswith("<div") else escape(text)


def _table(rows: Iterable[str]) -> str:
    cells = "".join(f"<tr>{row}</tr>" for row in rows)
    return f'<table class="tri-glide-numbers">{cells}</table>'
