"""What a soak drives and what it finds: machines with their limits, and every setpoint judged.

Limits are compared with finite differences of the heights alone, as a drive sees them; places by
the forward kinematics.
"""

import math
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.control import ControllerStatus
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Cylinder, Workspace, WorkspaceLimits, overruns

MACHINE = TriGlide(DEFAULT_GEOMETRY)
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
UNEQUAL = TriGlideGeometry(((0.01, 0.21), (-0.18, -0.09), (0.165, -0.11)), (0.40, 0.42, 0.385))
# As in config/tri_glide.yaml.
CONFIGURED = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
WORKSPACE = Workspace(MACHINE, CONFIGURED)
WIDE = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 20.0)
NARROW = WorkspaceLimits(
    (0.35, 0.3, 0.32),
    (0.85, 0.9, 0.88),
    0.01,
    6.0,
    box_lower=(-0.12, -0.15, 0.0),
    box_upper=(0.15, 0.12, 0.5),
    cylinder=Cylinder(0.01, 0.0, 0.14, -0.5, 1.0),
)


@dataclass(frozen=True)
class Scenario:
    """A machine, its limits and how it is driven.

    Attributes:
        kind: of moves.
        dt: of each step [s].
        irregular: whether the steps are between a hundredth of ``dt`` and ``dt`` long, at random.
        geometry: of the machine.
        workspace: limits of the place.
        limits: of the sliders, before they are changed.
        in_pieces: whether plans are made in pieces, of which a random number fits in each cycle.
    """

    kind: MotionKind
    dt: float
    geometry: TriGlideGeometry = DEFAULT_GEOMETRY
    workspace: WorkspaceLimits = WIDE
    limits: SliderLimits = LIMITS
    in_pieces: bool = False
    irregular: bool = False

    def __str__(self) -> str:
        """Return what tells it from the others."""
        number = (SCENARIOS + COARSE).index(self)
        marks = "-irregular" * self.irregular + "-in pieces" * self.in_pieces
        return f"{number}-{self.kind.value}-{self.dt}{marks}"

    def step(self, rng: np.random.Generator) -> float:
        """Return how long the next step is [s]."""
        return self.dt * 10.0 ** rng.uniform(-2.0, 0.0) if self.irregular else self.dt


UNEQUAL_LIMITS = SliderLimits((1.0, 0.6, 0.8), (10.0, 12.0, 6.0), (200.0, 150.0, 300.0))
WITHIN_COMMANDS = (
    Scenario(MotionKind.SLIDER, 0.001),
    Scenario(MotionKind.LINEAR, 0.001),
    Scenario(MotionKind.SLIDER, 0.002, DEFAULT_GEOMETRY, NARROW),
    Scenario(MotionKind.LINEAR, 0.002, DEFAULT_GEOMETRY, NARROW),
    Scenario(MotionKind.SLIDER, 0.001, UNEQUAL, WIDE, UNEQUAL_LIMITS),
    Scenario(MotionKind.LINEAR, 0.002, UNEQUAL, WIDE, UNEQUAL_LIMITS),
)
SCENARIOS = (*WITHIN_COMMANDS, *(replace(each, in_pieces=True) for each in WITHIN_COMMANDS))

# Steps in which whole plans begin and end, as no controller has them: an engine may be stepped so.
STIFF = SliderLimits.uniform(1.0, 10.0, 5000.0)
COARSE = (
    Scenario(MotionKind.SLIDER, 0.02, limits=STIFF),
    Scenario(MotionKind.LINEAR, 0.05, irregular=True),
    Scenario(MotionKind.SLIDER, 0.05, limits=STIFF, irregular=True, in_pieces=True),
)


@dataclass
class Findings:
    """What a soak has seen.

    Attributes:
        steps: number of setpoints.
        commands: how many of each kind were accepted.
        refusals: how many were refused, by the name of the error.
        peaks: largest finite differences as a part of their limits: velocity, acceleration, jerk.
        travel: largest overrun of slider travel; negative if never reached [m].
        place: largest overrun of the other limits of the workspace [m].
        still: how many of the steps moved nothing.
        violations: descriptions of the first few.
        plans: how many were made, where this is counted.
    """

    steps: int = 0
    commands: Counter[str] = field(default_factory=Counter)
    refusals: Counter[str] = field(default_factory=Counter)
    peaks: FloatArray = field(default_factory=lambda: np.zeros(3))
    travel: float = -math.inf
    place: float = -math.inf
    still: int = 0
    violations: list[str] = field(default_factory=list)
    plans: int = 0

    def refused(self, error: KinematicsError) -> None:
        """Note that a command was refused."""
        self.refusals[type(error).__name__] += 1

    def drove(self, heights: FloatArray) -> None:
        """Note setpoints [m]. Shape (n, 3)."""
        self.steps += len(heights)
        self.still += int((np.diff(heights, axis=0) == 0.0).all(axis=1).sum())

    def told(self, status: ControllerStatus) -> None:
        """Note what a controller has told."""

    def violated(self, text: str) -> None:
        """Note a violation."""
        if len(self.violations) < 20:
            self.violations.append(text)


class Judge:
    """Checks recorded heights by differences, from batch to batch without a gap."""

    def __init__(
        self, scenario: Scenario, findings: Findings, *, starts_inside: bool = True
    ) -> None:
        """Judge the setpoints of a ``scenario`` and note what is found in ``findings``.

        Args:
            scenario: machine and limits.
            findings: to be added to.
            starts_inside: whether each start is inside the workspace, which then must not be left.
        """
        self._scenario = scenario
        self._starts_inside = starts_inside
        self._machine = TriGlide(scenario.geometry)
        self._findings = findings
        self._heights = np.empty((0, 3))
        self._periods = np.empty(0)
        self._bounds = np.empty((0, 3, 3))
        self._streak = np.empty(0, dtype=np.int64)

    def add(
        self,
        heights: FloatArray,
        bounds: FloatArray,
        streak: NDArray[np.int64],
        periods: FloatArray | None = None,
    ) -> None:
        """Check setpoints that follow those added before.

        Args:
            heights: Shape (n, 3) [m].
            bounds: of velocity, acceleration and jerk in the step that led to each.
                Shape (n, 3, 3).
            streak: number of steps since the last start, 0 for the setpoint of the start itself.
                Shape (n,).
            periods: of the step that led to each [s]; that of the scenario without. Shape (n,).
        """
        if periods is None:
            periods = np.full(len(heights), self._scenario.dt)
        fresh = len(self._heights)
        heights = np.concatenate((self._heights, heights))
        periods = np.concatenate((self._periods, periods))
        bounds = np.concatenate((self._bounds, bounds))
        streak = np.concatenate((self._streak, streak))
        stream = CommandStream.from_heights(heights, periods)
        use = LimitUse.of(stream, bounds, streak == 0).part(fresh, len(heights))
        self._findings.peaks = np.maximum(self._findings.peaks, use.largest)
        for violation in use.violations(self._findings.steps):
            self._findings.violated(f"{violation} of {self._scenario}")
        if self._starts_inside:
            self._check_places(heights[fresh:])
        self._findings.drove(heights[fresh:])
        self._heights, self._periods = heights[-3:], periods[-3:]
        self._bounds, self._streak = bounds[-3:], streak[-3:]

    def _check_places(self, heights: FloatArray) -> None:
        found = overruns(self._machine, self._scenario.workspace, heights)
        findings = self._findings
        # What is not finite stays so.
        findings.travel = float(np.maximum(findings.travel, found.travel.max()))
        place = np.maximum(found.reach, found.place).max()
        findings.place = float(np.maximum(findings.place, place))
        if found.are_outside.any():
            row = int(found.are_outside.argmax())
            numbers = ", ".join(
                f"{name} {float(values[row]):.3g}" for name, values in found._asdict().items()
            )
            findings.violated(f"workspace left by {numbers} in {self._scenario}")
