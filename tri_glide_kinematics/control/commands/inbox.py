"""Commands to the controller, of which the newest of each kind wins. No ROS in here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import ClassVar

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.trajectory import SliderLimits
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import vector_text

# In motion, two commands of one kind are carried out at least this time apart [s]: each is a new
# plan, which takes some milliseconds.
COMMAND_INTERVAL = 0.005


class Kind(Enum):
    """What replaces what: of one kind, the newest command wins."""

    TARGET = "target"
    LIMITS = "limits"


class TargetKind(IntEnum):
    """What a target asks for, as programs read it in ``MachineState``."""

    POSITION = 1
    VELOCITY = 2
    MOVING = 3
    PATH = 4


@dataclass(frozen=True)
class TargetPosition:
    """Where the platform is to be moved [m]."""

    kind: ClassVar = TargetKind.POSITION
    position: Vector3
    velocity: ClassVar = None

    def __str__(self) -> str:
        """Return the target in words."""
        return f"target {vector_text(self.position, 6)} m"


@dataclass(frozen=True)
class TargetVelocity:
    """How the platform is to move [m/s], when that came in [s], and how long after the last."""

    kind: ClassVar = TargetKind.VELOCITY
    velocity: Vector3
    received: float
    pause: float
    position: ClassVar = None

    def __str__(self) -> str:
        """Return the target in words."""
        return f"twist {vector_text(self.velocity, 6)} m/s"


@dataclass(frozen=True)
class TrackedTarget:
    """A target that moves.

    Attributes:
        position: where it was [m].
        velocity: how it moves [m/s].
        seen: when it was there, by the clock of the controller [s].
        received: when that came in [s].
        pause: how long after the last one that was [s].
    """

    kind: ClassVar = TargetKind.MOVING
    position: Vector3
    velocity: Vector3
    seen: float
    received: float
    pause: float

    def __str__(self) -> str:
        """Return the target in words."""
        return (
            f"moving target {vector_text(self.position, 6)} m, "
            f"velocity {vector_text(self.velocity, 6)} m/s"
        )


@dataclass(frozen=True, eq=False)
class TargetPath:
    """Lines and arcs to follow.

    Attributes:
        make: makes them, in pieces, from the end of the path that they extend [m]; from where they
            begin if that is None.
        name: in words.
        extends: whether they go on from the end of the path that is followed, if there is one.
    """

    kind: ClassVar = TargetKind.PATH
    make: Callable[[Vector3 | None], Interruptible[PlatformPath]]
    name: str
    extends: bool = False
    position: ClassVar = None
    velocity: ClassVar = None

    def __str__(self) -> str:
        """Return the target in words."""
        return self.name


@dataclass(frozen=True)
class NewLimits:
    """What the drives may do from now on."""

    sliders: SliderLimits
    speed_scale: float


Target = TargetPosition | TargetVelocity | TrackedTarget | TargetPath
Command = Target | NewLimits


class Inbox:
    """Hands out one command in a cycle at most, however many come in.

    A flood so costs one plan in a cycle at most, and one in ``COMMAND_INTERVAL`` for each kind.
    What needs no plan has its turn in each cycle.

    Attributes:
        waiting: the command that waits, of each kind that has one.
    """

    def __init__(self, period: float) -> None:
        """Hold nothing yet, and count in cycles of ``period`` [s]."""
        self.waiting: dict[Kind, Command] = {}
        self._interval = math.ceil(COMMAND_INTERVAL / period - 1e-9)
        self._last_turn = dict.fromkeys(Kind, -self._interval)

    def put(self, kind: Kind, command: Command) -> None:
        """Hold the ``command``, in place of an older one of its ``kind``."""
        self.waiting[kind] = command

    def drop(self, kind: Kind) -> Command | None:
        """Forget, and return, what waits of this ``kind``."""
        return self.waiting.pop(kind, None)

    def take(self, cycle: int, in_each: bool) -> Command | None:
        """Return the command whose turn it is, None if there is none.

        Args:
            cycle: number of the present cycle.
            in_each: whether no command has to wait for longer than a cycle: nothing moves, or what
                waits needs no plan.
        """
        if not self.waiting or cycle in self._last_turn.values():
            return None
        interval = 1 if in_each else self._interval
        due = [kind for kind in self.waiting if cycle - self._last_turn[kind] >= interval]
        if not due:
            return None
        kind = min(due, key=self._last_turn.__getitem__)
        self._last_turn[kind] = cycle
        return self.waiting.pop(kind)
