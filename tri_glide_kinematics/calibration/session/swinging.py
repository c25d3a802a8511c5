"""Decides how a search for modes goes on: a move, the swing behind it, the next.

It reads no clock, and knows no ROS: a ``SwungMachine`` takes goals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from tri_glide_kinematics.calibration.ringdown import Quantity, Recording
from tri_glide_kinematics.calibration.session.leading import (
    Course,
    Delivery,
    Leader,
    Leading,
    LeadingError,
)
from tri_glide_kinematics.checks import finite, finite_vector, positive
from tri_glide_kinematics.control import WAS_STOPPED
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.motion.engine import GoalCode, Outcome
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.simulation import TrueMachine
from tri_glide_kinematics.vectors import Vector3, combined
from tri_glide_kinematics.wording import number_text, vector_text
from tri_glide_kinematics.workspace import Workspace

ACCELEROMETER = "imu/data_raw"

X_Y_Z: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# Most directions in one recording.
MOST_DIRECTIONS = 9
# Bounds and default of a move, and of the time for which its swing is recorded.
LENGTHS, LENGTH = (0.001, 0.5), 0.02  # m
DURATIONS, DURATION = (0.2, 60.0), 2.0  # s

# Stops of the platform in each direction, as parts of the length. A move excites no mode whose
# period fits its ramps; the three lengths have different ramps.
STOPS = (1.0, 0.4, 0.0)

# Setpoints rest at a target if they are so near to it, and so slow [m], [m/s].
AT_TARGET, AT_REST = 1e-6, 1e-6
# The setpoints have arrived; where the platform is measured is another matter.
ARRIVED = (GoalCode.SUCCEEDED, GoalCode.NOT_REACHED)
# Farther from it, somebody else has moved them [m].
LARGEST_DEVIATION = 1e-5
# The sliders lag behind their setpoints. So a recording begins this long after the last one [s].
SETTLING = 0.02
# Until ik_node has answered, and until a goal that was taken back has ended [s].
LONGEST_ANSWER = 5.0
LONGEST_END = 10.0
# A message that took longer than this, or came before it was sent, has the time of a clock that is
# set otherwise [s].
LARGEST_DELAY = 1.0
# Before anything moves, so many samples have to come in this time [s].
FEWEST_SAMPLES = 10
LONGEST_LISTENING = 3.0
# A machine that is silent for longer is gone; a longer gap of our own leaves its state unknown [s].
LONGEST_SILENCE = 1.0
# A slow machine takes long, and a target that is not reached is waited for [s].
LONGEST_MOVE = 120.0


@dataclass(frozen=True)
class SwingSettings:
    """Which moves are made, and for how long the swing behind each of them is recorded.

    Attributes:
        directions: of the moves, of any length. Shape (n, 3).
        length: of a move [m].
        duration: of each recording [s].
        place: where the moves begin. Shape (3,) [m]; None for where the platform is.
    """

    directions: tuple[Vector3, ...] = X_Y_Z
    length: float = LENGTH
    duration: float = DURATION
    place: Vector3 | None = None

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            KinematicsError: if one is outside its bounds, or a direction is none.
        """
        count = len(self.directions)
        if not 1 <= count <= MOST_DIRECTIONS:
            raise OutOfBoundsError("number of directions", count, f"1 to {MOST_DIRECTIONS}")
        for index, direction in enumerate(self.directions):
            name = f"directions[{index}]"
            positive(f"length of {name}", math.hypot(*finite_vector(name, direction, 3)))
        for name, value, (least, most), unit in (
            ("length", self.length, LENGTHS, "m"),
            ("duration", self.duration, DURATIONS, "s"),
        ):
            if not least <= finite(name, value) <= most:
                raise OutOfBoundsError(name, value, f"from {least:g} to {most:g}", unit)
        if self.place is not None:
            finite_vector("place", self.place, 3)


@dataclass(frozen=True)
class SwingMove:
    """A straight move.

    Attributes:
        target: of the platform. Shape (3,) [m].
        heights: true ones of the sliders there. Shape (3,) [m].
        is_recorded: whether the swing behind it counts.
    """

    target: Vector3
    heights: Vector3
    is_recorded: bool = True


def swing_moves(
    workspace: Workspace, start: Vector3, settings: SwingSettings
) -> tuple[SwingMove, ...]:
    """Return the moves, all of which stay inside the workspace.

    Args:
        workspace: of the machine.
        start: where the platform is. Shape (3,) [m].
        settings: what is asked for.

    Raises:
        KinematicsError: if a way leaves the workspace; the text has the place and the bound.
    """
    place = settings.place or start
    moves = [] if settings.place is None else [_checked_move(workspace, start, place, False)]
    for direction in settings.directions:
        size = settings.length / math.hypot(*direction)
        before = place
        for part in STOPS:
            target = combined(1.0, place, part * size, direction)
            moves.append(_checked_move(workspace, before, target, True))
            before = target
    return tuple(moves)


def _checked_move(
    workspace: Workspace, start: Vector3, target: Vector3, is_recorded: bool
) -> SwingMove:
    workspace.check_segment(start, target)
    return SwingMove(target, workspace.machine.inverse(target), is_recorded)


class IkSettings(NamedTuple):
    """What ik_node tells of its parameters.

    Attributes:
        workspace: with the travel as it is in truth.
        height_offsets: true heights minus those reported. Shape (3,) [m].
        shaper: its name; None if there is none.
    """

    workspace: Workspace
    height_offsets: Vector3
    shaper: str | None


class SwingGoal(Protocol):
    """A goal that was sent."""

    @property
    def result(self) -> Outcome | None:
        """How it ended; None before."""

    def cancel(self) -> None:
        """Ask for a stop; the result comes when the platform rests."""


class SwungMachine(Protocol):
    """What a search asks for."""

    @property
    def server(self) -> str:
        """Name of the one that takes the goals."""

    @property
    def is_ready(self) -> bool:
        """Whether there is somebody who takes goals and tells parameters."""

    def ask(self) -> Callable[[], IkSettings | None]:
        """Ask for the settings; what is returned returns None until they have come.

        It raises a KinematicsError if they are of no use.
        """

    def move_to(self, position: Vector3, *, kind: str) -> SwingGoal:
        """Send a goal: to a ``position`` [m]."""

    def listen(self, by_heights: bool) -> str:
        """Begin to listen to the swing and to setpoints, and return the topic of the swing."""

    def let_go(self) -> None:
        """Listen no more."""


class SwingSearch(Leader):
    """All moves, one after the other, each with the recording of the swing behind it.

    Attributes:
        recordings: so far.
        failure: what went wrong, in words; None if nothing did.
    """

    def __init__(
        self,
        leading: Leading,
        swung: SwungMachine,
        moves: Sequence[SwingMove],
        duration: float,
        sensor: tuple[str, Quantity, tuple[str, ...]],
    ) -> None:
        """Begin at rest.

        Args:
            leading: that lets it lead.
            swung: that takes goals.
            moves: to be made.
            duration: of each recording [s].
            sensor: topic, quantity, and names of the axes.
        """
        self.recordings: list[Recording] = []
        self.failure: str | None = None
        self._leading, self._swung = leading, swung
        self._moves = moves
        self._duration = duration
        self._topic, self._quantity, self._names = sensor
        self._stops = leading.machine.stops
        # Where ik_node commands the sliders to be, when it was sent, and when it came in.
        self._state: SliderState | None = None
        self._sent = self._told = leading.now
        self._heard, self._stamp, self._count = leading.now, -math.inf, 0
        self._samples: list[tuple[float, Vector3]] = []
        self._begin, self._is_recorded_whole = math.inf, False
        self._goal: SwingGoal | None = None

    def setpoints(self, state: SliderState | None, delivery: Delivery) -> None:
        """Take in where ik_node commands the sliders to be; None if it does not lead them."""
        if self._is_timely(delivery):
            self._state, self._sent, self._told = state, delivery.sent, delivery.now

    def measured(self, heights: Vector3, stamp: float, delivery: Delivery) -> None:
        """Take in reported heights [m], if they are what is recorded."""
        if self._quantity is Quantity.POSITION and self._is_timely(delivery):
            self._keep(heights, stamp, delivery)

    def sample(self, values: Vector3 | None, stamp: float, delivery: Delivery) -> None:
        """Take in what an accelerometer tells [m/s^2]; None if it measures no such thing."""
        if values is None:
            self._leading.fail(f"the sensor on {ACCELEROMETER} measures no accelerations")
        elif stamp > 0.0 and self._is_timely(delivery):
            self._keep(values, stamp, delivery)

    def _keep(self, values: Vector3, stamp: float, delivery: Delivery) -> None:
        """Keep a sample; one that is not finite, or not later than the one before, is missing."""
        if not stamp > self._stamp or not all(map(math.isfinite, values)):
            return
        self._stamp, self._heard = stamp, delivery.now
        self._count += 1
        if self._begin <= delivery.sent <= self._begin + self._duration:
            self._samples.append((stamp, values))
        self._is_recorded_whole |= delivery.sent > self._begin + self._duration

    def _is_timely(self, delivery: Delivery) -> bool:
        """Tell whether the sender's clock is ours; one that is not ends the search."""
        delay = delivery.received - delivery.sent
        if abs(delay) > LARGEST_DELAY:
            self._leading.fail(
                f"a message came {number_text(delay, 3)} s after it was sent, at most "
                f"{LARGEST_DELAY:g} s can be: are the clocks of the computers set alike?"
            )
        return abs(delay) <= LARGEST_DELAY

    def led(self) -> Course[None]:
        """Send one goal after the other, until nothing moves for the search any more."""
        try:
            yield from self._listened()
            for move in self._moves:
                yield from self._made(move)
        except LeadingError as error:
            self.failure = str(error)
        if self._goal is not None and self._goal.result is None:
            self._goal.cancel()
            end = self._leading.now + LONGEST_END
            # One that is gone tells nothing more.
            while self._goal.result is None and self._swung.is_ready and self._leading.now <= end:
                yield

    def _listened(self) -> Course[None]:
        """Wait for the sensor and for setpoints."""
        end = self._leading.now + LONGEST_LISTENING
        while self._state is None or self._count < FEWEST_SAMPLES:
            if self._leading.now > end:
                bound = f"in {LONGEST_LISTENING:g} s"
                raise LeadingError(
                    f"{self._count} samples with ascending stamps have come on {self._topic} "
                    f"{bound}, at least {FEWEST_SAMPLES} are needed"
                    if self._state
                    else f"ik_node has told of no setpoints on motion_state {bound}: "
                    f"{self._leading.machine}"
                )
            yield from self._look()

    def _made(self, move: SwingMove) -> Course[None]:
        """Make a ``move``, and record the swing behind it."""
        leading = self._leading
        self._begin, self._is_recorded_whole = math.inf, False
        self._goal = goal = self._swung.move_to(move.target, kind="linear")
        begun, ended = leading.now, math.inf
        while not (self._is_recorded_whole and ended <= leading.now):
            yield from self._look()
            now = leading.now
            if goal.result is not None and ended > now:
                ended = now
                if goal.result.code not in ARRIVED:
                    target = vector_text(move.target)
                    raise LeadingError(
                        f"the move to {target} m did not end there: {goal.result.text}"
                    )
            self._check_silence(now)
            if now - begun > LONGEST_MOVE + self._duration:
                raise LeadingError(
                    f"the move has not ended after {number_text(now - begun, 3)} s: "
                    f"{leading.machine}"
                )
            # The end of a goal may be heard before its last setpoint, but not long before.
            self._check_setpoints(move, is_late=now > ended + LONGEST_SILENCE)
        if move.is_recorded:
            self._keep_recording()

    def _check_setpoints(self, move: SwingMove, is_late: bool) -> None:
        """Begin to record when the setpoints rest at the end of the move; there they have to stay.

        Raises:
            LeadingError: if they do not, or ``is_late`` and they are not there.
        """
        if self._state is None:
            raise LeadingError("ik_node leads the machine no more")
        away = max(abs(one - other) for one, other in zip(self._state.heights, move.heights))
        is_recording = self._begin < math.inf
        if not is_recording and away <= AT_TARGET:
            if max(map(abs, self._state.velocities)) <= AT_REST:
                self._samples, self._begin = [], self._sent + SETTLING
        elif away > LARGEST_DEVIATION and (is_recording or is_late):
            raise LeadingError(
                f"the setpoints are {number_text(1e3 * away, 3)} mm away from the end of the "
                "move: somebody else leads the platform"
            )

    def _check_silence(self, now: float) -> None:
        if now - self._told > LONGEST_SILENCE:
            raise LeadingError(
                f"ik_node has told nothing on motion_state for {LONGEST_SILENCE:g} s: does it run?"
            )
        if now - self._heard > LONGEST_SILENCE:
            raise LeadingError(f"no sample has come on {self._topic} for {LONGEST_SILENCE:g} s")

    def _keep_recording(self) -> None:
        if len(self._samples) < FEWEST_SAMPLES:
            raise LeadingError(
                f"{len(self._samples)} samples have come on {self._topic} in "
                f"{self._duration:g} s, at least {FEWEST_SAMPLES} are needed"
            )
        times = np.array([stamp for stamp, _ in self._samples])
        values = np.array([values for _, values in self._samples])
        self.recordings.append(Recording(times, values, self._quantity, self._names))

    def _look(self) -> Course[None]:
        yield from self._leading.next_look(LONGEST_SILENCE)
        if self._leading.machine.stops != self._stops:
            raise LeadingError(WAS_STOPPED)


def swing_search(
    leading: Leading,
    machine: SwungMachine,
    settings: SwingSettings,
    slider_names: Sequence[str] | None,
) -> Course[SwingSearch]:
    """Make all moves, and record the swing behind each; the search tells what failed.

    Args:
        leading: that lets it lead.
        machine: that takes goals.
        settings: which moves.
        slider_names: to record measured heights; None for what an accelerometer tells.

    Raises:
        KinematicsError: if it is not possible to begin.
    """
    stops = leading.stops
    _check_machine(leading, machine)
    told, end = machine.ask(), leading.now + LONGEST_ANSWER
    while (asked := told()) is None:
        if leading.now > end:
            raise LeadingError(f"ik_node has not told its parameters in {LONGEST_ANSWER:g} s")
        yield
    workspace, offsets, shaper = asked
    if shaper is not None:
        raise LeadingError(
            f"ik_node has the shaper {shaper}, which takes away the swing that is to be "
            "measured: set its parameter shaper to none first"
        )
    believed = TrueMachine(workspace.machine, offsets)
    start = believed.position((yield from leading.resting_heights()))
    leading.check_not_stopped(stops)
    moves = swing_moves(workspace, start, settings)
    _check_machine(leading, machine)
    quantity = Quantity.ACCELERATION if slider_names is None else Quantity.POSITION
    sensor = machine.listen(slider_names is not None), quantity, tuple(slider_names or "xyz")
    search = SwingSearch(leading, machine, moves, settings.duration, sensor)
    try:
        yield from leading.lead(search, search.led(), "a search for modes")
    finally:
        machine.let_go()
    return search


def _check_machine(leading: Leading, machine: SwungMachine) -> None:
    if not machine.is_ready:
        raise LeadingError(f"there is no {machine.server} that could move the platform")
    leading.check_idle()
