"""What a program means: paths, dwells, outputs and stops, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.motion.path import FlatPath
from tri_glide_kinematics.vectors import Vector3


class StopKind(Enum):
    """Why a program stops."""

    PAUSE = "M0"
    OPTIONAL = "M1"
    TOOL = "M6"
    END = "end"


class Output(NamedTuple):
    """An output that changes.

    Attributes:
        name: ``spindle`` (value in revolutions, negative for M4), ``flood``, ``mist``, ``fan``,
            ``digital`` (M62 to M65) or ``pin`` (M42).
        number: of several of its name.
        value: from now on.
        line: that says so.
        joint: index of the segment at whose begin it changes; 0 for one that is no part of a path.
    """

    name: str
    number: int
    value: float
    line: int
    joint: int


@dataclass(frozen=True, eq=False)
class PathRun:
    """A path that is driven without a stop, unless its tolerances ask for one.

    Attributes:
        start: where it begins. Shape (3,) [m].
        segments: of the path.
        lines: of the program, one for each segment. Shape (n,).
        rapid: which segments are G0. Shape (n,).
        outputs: that change at inner joints, in their order.
    """

    start: Vector3
    segments: FlatPath
    lines: NDArray[np.int32]
    rapid: NDArray[np.bool_]
    outputs: tuple[Output, ...]


class Dwell(NamedTuple):
    """Rest for a time [s].

    Attributes:
        duration: [s].
        line: that says so.
    """

    duration: float
    line: int


class ProgramStop(NamedTuple):
    """Rest until somebody lets it go on, or for good.

    Attributes:
        kind: why.
        line: that says so.
        tool: number of the tool that is wanted; of M6 alone.
    """

    kind: StopKind
    line: int
    tool: int = 0


class Told(NamedTuple):
    """Something that a program says and that is not done.

    Attributes:
        word: a letter or a command.
        line: the first that says it.
        reason: why it is not done.
    """

    word: str
    line: int
    reason: str


ProgramStep = PathRun | Dwell | Output | ProgramStop


@dataclass(frozen=True, eq=False)
class Program:
    """A program that is understood.

    Attributes:
        file: where it is from.
        steps: in their order.
        told: what is not done, each once.
        lines: how many there are.
    """

    file: str
    steps: tuple[ProgramStep, ...]
    told: tuple[Told, ...]
    lines: int
