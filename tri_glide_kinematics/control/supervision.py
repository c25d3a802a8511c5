"""Watches what has to come in time: measured heights, commands that are renewed, and programs.

What the sliders are measured to do is compared with what they were told. Of the commands it is
known how often they come, and when a stopped stream may go on. No ROS in here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from tri_glide_kinematics.control.operating_state import Cause, CommandRefusedError, Reason
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.motion.engine import Command, TargetKind
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


# Commands that come less often than this are those of a person, not a stream [s].
SLOWEST_STREAM = 1.0

# A stream that was stopped has let go when nothing came for this long, or for its timeout if that
# is longer: a network that is held up shall not set a stopped machine off [s].
LEAST_PAUSE = 0.5

# How fast two clocks may go apart: so much the usual age of commands is taken to grow [s/s].
DRIFT = 0.01


class Stream:
    """Knows when its commands came in, and whether their sender has let go after a stop.

    Attributes:
        timeout: longest time between two commands [s].
        looked_at: until when all commands that had come in were received [s].
    """

    def __init__(
        self, command: str, motion: str, release: str, timeout: float, silent: Cause
    ) -> None:
        """Wait for the first command.

        Args:
            command: what comes, in words; the timeout is the parameter with that name.
            motion: what goes on while they come, in words.
            release: what the sender has to do after a stop, in words.
            timeout: longest time between two commands [s].
            silent: cause of the stop when they do not come any more.
        """
        self.timeout = timeout
        self.looked_at = math.inf
        self._command = command
        self._motion = motion
        self._release = release
        self._silent = silent
        self._received = -math.inf
        self._accepted = -math.inf
        self._release_needed = False
        # That of the quickest command, by clocks that need not be set alike [s].
        self._usual_age = math.inf

    def receive(self, now: float, released: bool = False) -> float:
        """Note a command that comes in ``now`` [s]; return how long after the last one [s].

        A pause of the sender is what was seen of it: if nobody looked for commands meanwhile, this
        one may have waited for long.

        Args:
            now: time of receipt [s].
            released: whether it says that the sender lets go.
        """
        seen_pause = min(now, self.looked_at) - self._received
        pause, self._received = now - self._received, now
        self._usual_age += DRIFT * min(pause, LEAST_PAUSE)
        if released or seen_pause > self._least_pause:
            self._release_needed = False
            self._usual_age = math.inf
        return pause

    @property
    def _least_pause(self) -> float:
        return max(self.timeout, LEAST_PAUSE)

    def need_release(self) -> None:
        """Listen to no command before the sender has let go."""
        self._release_needed = True

    def check_released(self) -> None:
        """Check that commands are listened to.

        Raises:
            CommandRefusedError: if their sender did not let go since the motion was stopped.
        """
        if self._release_needed:
            raise CommandRefusedError(
                f"{self._motion} was stopped: it needs {self._release} of "
                f"{self._least_pause:g} s before it goes on",
                Refusal.NOT_RELEASED,
            )

    def check_age(self, age: float) -> None:
        """Check that a command was not held up on its way, by the ``age`` of its stamp [s].

        NaN is no stamp. Clocks need not be set alike: what counts is how much older it is than the
        quickest one since the sender let go.

        Raises:
            CommandRefusedError: if that is more than the timeout.
        """
        self._usual_age = min(self._usual_age, age)
        late = age - self._usual_age
        if late > self.timeout:
            raise CommandRefusedError(
                f"the {self._command} is {number_text(late, 2)} s older than the quickest one, by "
                f"its stamp: at most {self._command}_timeout, {self.timeout:g} s",
                Refusal.STAMP,
            )

    def accept(self, received: float) -> None:
        """Note that a command that came in at ``received`` [s] is carried out."""
        self._accepted = received

    def silence(self, now: float) -> Reason | None:
        """Return why the motion has to end ``now`` [s], or None."""
        if now - self._accepted > self.timeout:
            return Reason(self._silent, f"no {self._command} for {self.timeout:g} s")
        return None

    def remark(self, pause: float) -> str:
        """Return what is to be said of a stream with such a ``pause`` [s]; empty if it is fine."""
        if not self.timeout < pause < SLOWEST_STREAM:
            return ""
        return (
            f", {number_text(pause, 2)} s after the last one: longer than "
            f"{self._command}_timeout, {self.timeout:g} s"
        )


@dataclass(frozen=True)
class Streams:
    """All that has to be renewed.

    Attributes:
        twists: of jogs.
        targets: states of a moving target.
    """

    twists: Stream
    targets: Stream

    @classmethod
    def with_timeouts(cls, twist: float, target: float) -> Streams:
        """Return both, with the longest times between two commands [s]."""
        release = "a twist of zero or a pause"
        return cls(
            Stream("twist", "jogging", release, twist, Cause.TWISTS_SILENT),
            Stream("target", "tracking", "a pause", target, Cause.TARGETS_SILENT),
        )

    def of(self, command: Command) -> Stream | None:
        """Return the stream that a ``command`` is of; None if it need not be renewed."""
        if command.kind is TargetKind.VELOCITY:
            return self.twists
        return self.targets if command.kind is TargetKind.MOVING else None

    def looked(self, now: float) -> None:
        """Note that all commands that have come in until ``now`` [s] were received."""
        self.twists.looked_at = self.targets.looked_at = now

    def need_release(self) -> None:
        """Listen to none before its sender has let go."""
        self.twists.need_release()
        self.targets.need_release()


# A cycle that comes late counts for no more than this part of the timeout: what has come in
# meanwhile is read in the next ones.
LONGEST_CYCLE = 0.1


@dataclass
class ToldRun:
    """A run of a program, as it was told last.

    Attributes:
        name: file and line, for people.
        safe_outputs: that it leaves behind if it is lost.
        silence: since then [s].
    """

    name: str
    safe_outputs: Sequence[Any]
    silence: float = 0.0


class ProgramRuns:
    """Knows which runs of programs go on: each is renewed as long as what drives it lives.

    Attributes:
        timeout: longest time without a word of a run [s].
        safe_outputs: of runs that were lost; who publishes them, at rest, clears it.
    """

    def __init__(self, timeout: float) -> None:
        """Know of no run."""
        self.timeout = timeout
        self.safe_outputs: list[Any] = []
        self._runs: dict[int, ToldRun] = {}
        self._looked = -math.inf

    def tell(self, number: int, run: ToldRun, *, has_ended: bool) -> None:
        """Take in what is told of the run of a ``number``."""
        self._runs.pop(number, None)
        if not has_ended:
            self._runs[number] = run

    def lost(self, now: float) -> Reason | None:
        """Return why the machine has to stop ``now`` [s], as a run is told no more; or None.

        To be called in each control cycle. The run is forgotten: told again, it is another one.
        """
        passed = min(now - self._looked, LONGEST_CYCLE * self.timeout)
        self._looked = now
        reason = None
        for number, run in list(self._runs.items()):
            run.silence += passed
            if run.silence > self.timeout:
                del self._runs[number]
                self.safe_outputs += run.safe_outputs
                reason = Reason(
                    Cause.PROGRAM_LOST,
                    f"what drives {run.name} has told nothing for {number_text(self.timeout)} s",
                )
        return reason
