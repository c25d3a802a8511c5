"""How many functions of the package a control cycle calls: at rest, in a move, following a target.

In Python a call costs time whatever it does. So the number of calls tells what a change has done to
each cycle, and unlike a time it is the same in each run and on each computer. What is counted is
``MotionController.cycle`` with an engine that plans in pieces, as in the node; what the caller and
libraries do is not. It needs Python 3.11 or newer; from 3.12 on a comprehension is no call.
"""

import sys
from collections import Counter
from math import cos, pi, sin
from pathlib import Path
from types import CodeType, FrameType

import tri_glide_kinematics
from benchmarks.judge import LIMITS, WORKSPACE
from benchmarks.table import print_lines
from testing.controllers import PERIOD, controller_of
from tri_glide_kinematics.control import IDLE, MOVING, TRACKING, OperatingState
from tri_glide_kinematics.motion import MotionEngine
from tri_glide_kinematics.vectors import Vector3

PACKAGE = str(Path(tri_glide_kinematics.__file__).parent)
CYCLES = 50  # that are counted
# Cycles before that, in which a move is planned, and a target is reached.
BEFORE = {IDLE: 50, MOVING: 50, TRACKING: 500}
HOME = (0.6, 0.6, 0.6)  # m, heights
TARGET = (0.05, 0.03, 0.3)  # m
# A target that goes round in a circle, and is told so often.
RADIUS = 0.03  # m
RATE = pi  # rad/s
CYCLES_A_REPORT = 10
# Most calls in a cycle that are wanted.
GOALS = {IDLE: 30, MOVING: 35, TRACKING: 165}

Calls = Counter[CodeType]


class Machine:
    """A controller, and sliders that follow it perfectly."""

    def __init__(self) -> None:
        """Lead from home."""
        self.controller = controller_of(MotionEngine(WORKSPACE, LIMITS, in_pieces=True))
        self._now = 0.0
        self._heights: Vector3 = HOME
        self.controller.measured(HOME, self._now)

    def report_target(self) -> None:
        """Tell where on its circle the target is now."""
        angle = RATE * self._now
        x, y = RADIUS * cos(angle), RADIUS * sin(angle)
        velocity = (-RATE * y, RATE * x, 0.0)
        self.controller.track((x, y, TARGET[2]), velocity, self._now, self._now)

    def cycle(self) -> Calls:
        """Do what the node does in a period; return what was called for the setpoint."""
        self._now += PERIOD
        calls: Calls = Counter()

        def note(frame: FrameType, event: str, _argument: object) -> None:
            if event == "call" and frame.f_code.co_filename.startswith(PACKAGE):
                calls[frame.f_code] += 1

        sys.setprofile(note)
        setpoint = self.controller.cycle(self._now, lambda: True)
        sys.setprofile(None)
        if setpoint is not None:
            self._heights = setpoint.heights
        self.controller.measured(self._heights, self._now)
        self.controller.plan(lambda: True)
        return calls


def calls_in(state: OperatingState) -> Calls:
    """Return what is called in ``CYCLES`` cycles in a state: idle, moving or tracking."""
    machine = Machine()
    if state is MOVING:
        machine.controller.move_to(TARGET)
    calls: Calls = Counter()
    for number in range(-BEFORE[state], CYCLES):
        if number == 0:
            calls.clear()
        if state is TRACKING and number % CYCLES_A_REPORT == 0:
            machine.report_target()
        calls += machine.cycle()
        assert number < 0 or machine.controller.state is state
    return calls


def run() -> bool:
    """Count, and print a line for each function; return that the table is complete."""
    counts = {state: calls_in(state) for state in GOALS}
    names = [state.value for state in GOALS]
    rows: list[tuple[str, ...]] = [("calls inside the package in one cycle", *names)]
    rows.append(("all", *(f"{calls.total() / CYCLES:g}" for calls in counts.values())))
    rows.append(("wanted at most", *(f"{goal}" for goal in GOALS.values())))
    together = sum(counts.values(), Counter[CodeType]())
    for code, _ in together.most_common():
        module = Path(code.co_filename).relative_to(PACKAGE).with_suffix("")
        name = f"{'.'.join(module.parts)}: {code.co_qualname}"
        rows.append((name, *(f"{calls[code] / CYCLES:g}" for calls in counts.values())))
    return print_lines(rows)
