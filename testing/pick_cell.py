"""A cell in virtual time: the real controller and picker, a simulated belt, cameras and gripper."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from testing.controllers import PERIOD, controller_of
from tri_glide_kinematics.control import IDLE, MOVING
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, SliderLimits
from tri_glide_kinematics.motion.engine import Transfer
from tri_glide_kinematics.picking import (
    BeltMotion,
    GivingUp,
    Machine,
    PartEvent,
    Parts,
    Picker,
    PickOrder,
    PickSettings,
    Places,
    Readings,
    Renewal,
    SimulatedBelt,
    SimulatedCamera,
    SimulatedEncoder,
    SimulatedGripper,
    SimulatedPart,
    WayTimes,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

MACHINE = TriGlide(DEFAULT_GEOMETRY)
WORKSPACE = Workspace(MACHINE, WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0))
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)

LOW, HEIGHT = 0.25, 0.275
PLACE: Vector3 = (0.0, -0.1, LOW)
WINDOW = (-0.1, 0.08)
DWELLS = (0.03, 0.03)

SETTINGS = PickSettings(HEIGHT, dwells=DWELLS, allowed=1e-3)

# The picker is asked each so many cycles; pieces of planning in a cycle.
ASKED_EACH, PIECES = 3, 8


@dataclass
class Cell:
    """A machine beside a belt.

    Attributes:
        belt: as it truly moves.
        parts: on it.
        drive_delay: from a setpoint to the platform [s].
        latency: of the camera's pictures [s].
        noise: of a view [m].
        encoder_step: of the belt's encoder [m].
        silences: of the encoder, from when to when [s].
        view: from where to where along the belt the camera sees [m].
        first_way: how long a way is expected to take at first [s].
        outcomes: of the parts so far.
        lowest: of the setpoints, by z [m].
    """

    belt: SimulatedBelt
    parts: Sequence[SimulatedPart]
    drive_delay: float = 0.0
    latency: float = 0.05
    noise: float = 0.0
    encoder_step: float = 5e-5
    silences: Sequence[tuple[float, float]] = ()
    view: tuple[float, float] = (-0.45, -0.2)
    places: Places = field(default_factory=lambda: Places([PLACE], is_fixed=True))
    settings: PickSettings = SETTINGS
    first_way: float = 0.5
    limits: SliderLimits = LIMITS
    outcomes: list[PartEvent] = field(default_factory=list)
    lowest: float = math.inf
    now: float = 0.0

    def __post_init__(self) -> None:
        """Stand at rest in the place."""
        self.engine = MotionEngine(WORKSPACE, self.limits, in_pieces=True)
        self.controller = controller_of(self.engine, drive_delay=self.drive_delay)
        self.heights = MACHINE.inverse(PLACE)
        self._sent: deque[tuple[float, Vector3]] = deque()
        self.ways = WayTimes(PLACE, self.first_way, self.settings.dwells)
        order = PickOrder(self.belt.direction, WINDOW, self.ways)
        known = Parts(self.belt.direction, noise=max(self.noise, 1e-4))
        belt = BeltMotion(self.encoder_step)
        self.picker = Picker(belt, known, order, self.places, self.settings, self.ways.note)
        self.encoder = SimulatedEncoder(
            self.belt, Readings(100.0, 0.004), self.encoder_step, silences=self.silences
        )
        self.camera = SimulatedCamera(
            "camera",
            self.belt,
            self.parts,
            self.view,
            Readings(30.0, self.latency),
            self.noise,
        )
        self.gripper = SimulatedGripper(self.belt, self.parts, delay=self.settings.closing)
        self._transfer: Transfer | None = None
        self._cycles = 0
        self.refusals: list[str] = []
        self.cycle(10)

    def cycle(self, count: int = 1) -> None:
        """Let so many cycles pass."""
        for _ in range(count):
            self.now += PERIOD
            self._cycles += 1
            self._step()

    def _step(self) -> None:
        now, controller = self.now, self.controller
        setpoint = controller.cycle(now, lambda: False)
        if setpoint is not None:
            self._sent.append((now, setpoint.heights))
            self.lowest = min(self.lowest, MACHINE.forward(setpoint.heights)[2])
        while len(self._sent) > 1 and self._sent[1][0] <= now - self.drive_delay + 1e-9:
            self._sent.popleft()
        if self._sent:
            self.heights = self._sent[0][1]
        controller.measured(self.heights, now)
        controller.plan(partial(next, iter([True] * (PIECES - 1)), False))
        for report in self.encoder.take(now):
            self.picker.report(*report)
        for sighting in self.camera.take(now):
            self.picker.see(sighting)
        passed = [*controller.passed_outputs]
        controller.passed_outputs.clear()
        for closes in passed:
            self.gripper.order(closes, now)
        self.gripper.step(now, self.position)
        if passed or self._cycles % ASKED_EACH == 0:
            self._carry_out(self.picker.step(now, self._machine(passed)))
        self.outcomes += self.picker.events
        self.picker.events.clear()

    @property
    def position(self) -> Vector3:
        """Where the platform truly is [m]."""
        return MACHINE.forward(self.heights)

    def _machine(self, passed: Sequence[bool]) -> Machine:
        controller = self.controller
        progress, transfer = controller.transfer_progress, self._transfer
        arrivals: tuple[float, ...] = ()
        if progress is not None and transfer is not None and controller.leads_to(transfer):
            arrivals = tuple(arrival + self.drive_delay for arrival in progress.arrivals)
        accepts = controller.state in (IDLE, MOVING)
        status = controller.status
        return Machine(self.position, accepts, status.stops, arrivals, tuple(passed))

    def _carry_out(self, wanted: object) -> None:
        if isinstance(wanted, Transfer):
            self._transfer = wanted
            try:
                self.controller.pursue(wanted)
            except KinematicsError as error:
                self.refusals.append(str(error))
        elif isinstance(wanted, Renewal):
            if self.controller.renew(0, wanted.motion, wanted.seen):
                self.picker.renewed(wanted)
        elif isinstance(wanted, GivingUp) and self._transfer is not None:
            self.controller.cancel(self._transfer)

    def run_until(self, is_over: Callable[[Cell], bool], longest: float = 600.0) -> Cell:
        """Go on until something is so, or for so long [s]."""
        until = self.now + longest
        while not is_over(self) and self.now < until:
            self.cycle()
        return self

    def errors(self) -> list[float]:
        """Return how far the gripper was from the part each time that it had closed [m]."""
        return [math.hypot(*grip.error) for grip in self.gripper.grips]
