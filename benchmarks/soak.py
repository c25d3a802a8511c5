"""What soaks share: random actions, places, paths and shapers, one scenario after the other."""

import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, MACHINE, SCENARIOS, WORKSPACE, Findings, Scenario
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionKind, PlatformPath, SliderLimits
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Modes that are shaped for: frequencies [Hz], and the most damping.
FREQUENCIES, MOST_DAMPING = (8.0, 60.0), 0.15

# Part of the paths that are polylines of many points, as from a CAM program.
DENSE = 0.2


class RandomActions:
    """Actions that are done at random, each with its chance; refusals are counted."""

    def __init__(
        self,
        actions: Sequence[tuple[float, Callable[[], object]]],
        rng: np.random.Generator,
        findings: Findings,
    ) -> None:
        """Choose from ``actions``, pairs of a chance and what is done, by ``rng``."""
        self._actions = [action for _, action in actions]
        self._chances = np.cumsum([chance for chance, _ in actions])
        self._chances /= self._chances[-1]
        self._rng = rng
        self._findings = findings

    def drawn(self) -> Callable[[], object]:
        """Return one of the actions."""
        return self._actions[int(np.searchsorted(self._chances, self._rng.random()))]

    def attempt(self, action: Callable[[], object]) -> None:
        """Do one action, and count whether it was refused."""
        try:
            action()
        except KinematicsError as error:
            self._findings.refused(error)
        else:
            self._findings.commands[name_of(action)] += 1


def name_of(action: Callable[[], object]) -> str:
    """Return the name of a method that does an ``action``."""
    return action.__name__.strip("_")


def random_place(
    rng: np.random.Generator,
    workspace: Workspace,
    lower: Vector3 = (-0.3, -0.3, -0.2),
    upper: Vector3 = (0.3, 0.3, 0.8),
) -> Vector3:
    """Return a place inside the workspace, and between two corners [m]."""
    while True:
        x, y, z = rng.uniform(lower, upper).tolist()
        try:
            workspace.check_position((x, y, z))
        except KinematicsError:
            continue
        return x, y, z


def random_velocity(
    rng: np.random.Generator, slowest: float = 0.02, fastest: float = 1.0
) -> list[float]:
    """Return a velocity in any direction [m/s]; each magnitude of it is as likely."""
    direction = rng.normal(size=3)
    speed = slowest * (fastest / slowest) ** rng.random()
    return [float(speed * part) for part in direction / np.linalg.norm(direction)]


def random_path(rng: np.random.Generator, start: Vector3, size: float) -> PlatformPath:
    """Return lines and arcs, or a dense polyline, whose corners are rounded, or stops.

    Args:
        rng: source of chance.
        start: of the path. Shape (3,) [m].
        size: of its segments, about [m].
    """
    tolerance = float(rng.choice((0.0, 0.01, 0.1, 0.3))) * size
    if rng.random() < DENSE:
        return _dense(rng, start, size, tolerance)
    path = PlatformPath.start(start)
    for _ in range(rng.integers(1, 9)):
        speed = 10.0 ** rng.uniform(-2.0, 0.0) if rng.random() < 0.2 else None
        if rng.random() < 0.3:
            centre = np.array(path.end) + size * rng.normal(size=3)
            angle = float(rng.uniform(-7.0, 7.0))
            path = path.arc_about(centre, rng.normal(size=3), angle, tolerance, speed)
        else:
            path = path.line_to(np.array(path.end) + size * rng.normal(size=3), tolerance, speed)
    return path


def _dense(rng: np.random.Generator, start: Vector3, size: float, tolerance: float) -> PlatformPath:
    """Return a polyline along a circle."""
    angles = np.linspace(0.0, rng.uniform(1.0, 4.0 * math.pi), rng.integers(20, 300))
    first, second = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    around = (np.cos(angles) - 1.0)[:, np.newaxis] * first + np.sin(angles)[:, np.newaxis] * second
    return PlatformPath.through(np.array(start) + size * around, tolerance)


def random_shaper(rng: np.random.Generator) -> Shaper | None:
    """Return a shaper of any kind for one mode or two, or none."""
    if rng.random() < 0.3:
        return None
    modes = [
        Mode(rng.uniform(*FREQUENCIES), rng.uniform(0.0, MOST_DAMPING))
        for _ in range(rng.integers(1, 3))
    ]
    return Shaper.of(list(ShaperKind)[rng.integers(len(ShaperKind))], *modes)


def engine_at(
    place: Vector3,
    limits: SliderLimits = LIMITS,
    kind: MotionKind = MotionKind.SLIDER,
    *,
    in_pieces: bool = False,
) -> MotionEngine:
    """Return an engine of the default machine that rests at a ``place`` [m]."""
    engine = MotionEngine(WORKSPACE, limits, kind=kind, in_pieces=in_pieces)
    engine.start(MACHINE.inverse(place))
    return engine


def random_pauses(rng: np.random.Generator, count: int, step: float = 0.002) -> list[int]:
    """Return numbers of steps between commands: calm, busy, and now and then a flood.

    Args:
        rng: source of chance.
        count: of all steps.
        step: how long they are [s]; of long ones there are fewer between two commands.
    """
    often = max(1.0, step / 0.002)
    pauses: list[int] = []
    while sum(pauses) <= count:
        mood = rng.random()
        if mood < 0.5:
            pauses += rng.geometric(min(often / 300.0, 1.0), size=5).tolist()
        elif mood < 0.9:
            pauses += rng.geometric(min(often / 30.0, 1.0), size=15).tolist()
        else:
            pauses += [1] * int(rng.integers(5, 40))
    return [*pauses, count]


def some_pieces(rng: np.random.Generator) -> Callable[[], bool]:
    """Return what says yes a random number of times: how much planning fits in a cycle."""
    return pieces(int(rng.integers(1, 10)))


def pieces(count: int) -> Callable[[], bool]:
    """Return what says that planning may go on until ``count`` pieces are done."""
    left = iter(range(count - 1))
    return lambda: next(left, None) is not None


def soak_all(
    soak: Callable[[Scenario, int, int, Findings], None],
    what: str,
    default_steps: int,
    scenarios: Sequence[Scenario] = SCENARIOS,
) -> Findings:
    """Soak all ``scenarios``, and print what was accepted and refused, and what is wrong.

    Args:
        soak: takes a scenario, its number of steps, the seed, and what is found.
        what: is soaked, for the help.
        default_steps: in all.
        scenarios: which share the steps.
    """
    steps = default_steps, "setpoints to check in all"
    options = numbers(what, steps=steps, seed=(1, "of the random commands"))
    findings = Findings()
    began = time.monotonic()
    for number, scenario in enumerate(scenarios):
        part = options.steps // len(scenarios) + (number < options.steps % len(scenarios))
        soak(scenario, part, options.seed * 1000 + number, findings)
        print(
            f"{findings.steps:>9} steps, {sum(findings.commands.values())} commands, "
            f"{findings.plans} plans, {time.monotonic() - began:.0f} s",
            flush=True,
        )
    print("accepted:", dict(findings.commands.most_common()))
    print("refused: ", dict(findings.refusals.most_common()))
    for violation in findings.violations:
        print("VIOLATION:", violation)
    return findings
