"""A machine that probes and searches for modes lead: the real controller, a swing, and a plate.

Time is that of its cycles. What it is told comes at once, and what it tells does, too.
"""

import random
from concurrent.futures import Future

import pytest
from controller_rig import LOWER, MACHINE, PERIOD, UPPER, Rig

from tri_glide_kinematics.calibration.session import (
    Delivery,
    IkSettings,
    Leading,
    MachineView,
)
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionKind
from tri_glide_kinematics.motion.engine import Command, GoalCode, Move
from tri_glide_kinematics.simulation import SimulatedPlate, SimulatedSwing, SwingModel, TrueMachine
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

WALL = 1.7e9  # s, by which the clock of the computer is ahead of the steady one
CYCLES = 2  # between two looks
CONTACT_PERIOD = 10  # cycles
NOISE = 0.02  # m/s^2
GRAVITY = 9.80665  # m/s^2


class LedGoal:
    """A goal of the controller, as a search sees it."""

    def __init__(self, rig, command: Command):
        self._rig = rig
        self._command = command
        self.is_cancelled = False

    @property
    def result(self):
        return self._command.outcome if self._rig.is_alive and self._rig.goals_end else None

    def cancel(self):
        self.is_cancelled = True
        if self._rig.obeys:
            self._rig.controller.cancel(self._command)


class LedMachine(Rig):
    """A ``JoggedMachine`` and a ``SwungMachine``; what is wrong with it is set by attributes."""

    server = "/cell/ik_node"

    def __init__(self, start, *, modes=(), plate=-1.0, offsets=(0.0, 0.0, 0.0), **wrong):
        """Rest at ``start``; calibration believes in height ``offsets`` that there are not.

        Of the attributes, those that are ``wrong`` are so from the beginning.
        """
        self.is_alive = self.is_ready = self.is_there = True
        # Whether a goal ends when it is cancelled.
        self.obeys = True
        self.feels = self.measures_acceleration = self.has_switch = self.tells_setpoints = True
        # Whether the measured heights reach calibration, too; and what it is told instead of them.
        self.tells_heights = True
        self.seen = None
        self.encoders_see_swing = False
        # The stamp of a sample that is sent at a time [s]; whether goals tell that they have ended.
        self.stamp_of = float
        self.goals_end = True
        self.shaper = None
        # What people read of its states; None for what the controller says.
        self.text = None
        # When the parameters are told after they were asked for [s].
        self.answer_time = 0.01
        self.delay = 0.0  # s, of all messages, or a difference of clocks
        self.stamp_error = 0.0  # s, of measured heights
        self.plate = SimulatedPlate(plate, 0.0, 0.0)
        self.twists, self.moves, self.goals = [], [], []
        self.listens = None
        vars(self).update(wrong)
        self._swing = SimulatedSwing(start, SwingModel(modes))
        self._swung = start
        self._contact = (False, 0)
        self._told = None
        self._noise = random.Random(1)
        super().__init__(start=MACHINE.inverse(start), kind=MotionKind.LINEAR)
        self.leading = Leading()
        self.believed = TrueMachine(MACHINE, offsets)
        self.pass_time(0.5)

    # What those who lead it ask for

    def jog(self, upwards):
        self.twists.append((self.now, upwards))
        try:
            super().jog((0.0, 0.0, upwards))
        except KinematicsError as error:
            self.refusals.append(str(error))

    def ask(self):
        workspace = Workspace(MACHINE, WorkspaceLimits(LOWER, UPPER, 0.005, 6.0))
        settings = IkSettings(workspace, (0.0, 0.0, 0.0), self.shaper)
        due = self.now + self.answer_time
        return lambda: settings if self.now >= due else None

    def move_to(self, position, *, kind):
        assert kind == "linear"
        self.moves.append(position)
        goal = Move(position)
        try:
            self.controller.pursue(goal)
        except KinematicsError as error:
            goal.end(GoalCode.REFUSED, str(error))
        self.goals.append(LedGoal(self, goal))
        return self.goals[-1]

    def listen(self, by_heights):
        assert self.listens is None
        self.listens = "/cell/joint_states" if by_heights else "/cell/imu/data_raw"
        return self.listens

    def let_go(self):
        self.listens = None

    # What happens

    @property
    def place(self):
        return MACHINE.forward(self.heights)

    @property
    def measured(self):
        return MACHINE.inverse(self._swung) if self.encoders_see_swing else super().measured

    def send_pose(self, position):
        """Be told by somebody else to go elsewhere."""
        self.controller.move_to(position)
        self.leading.leader.target_pose()

    def look(self):
        for _ in range(CYCLES):
            self._pass_cycle()
        self.leading.look(self.now)

    def hold_up(self, duration):
        """Let time pass in which calibration does nothing."""
        end = self.now + duration
        while self.now < end:
            self._pass_cycle()

    def pass_time(self, duration):
        end = self.now + duration
        while self.now < end:
            self.look()

    def look_until(self, condition, most=60.0):
        end = self.now + most
        while not condition():
            assert self.now < end, f"not in {most} s: {self.controller.status}"
            self.look()

    def look_until_state(self, state):
        self.look_until(lambda: self.controller.state is state)

    def shake_until(self, condition):
        """Let a slider be measured to move, until something holds; the machine is idle."""
        self.offset = 0.001
        while not condition():
            self.offset = -self.offset
            self.look()
        self.offset = 0.0

    def shake(self, duration):
        end = self.now + duration
        self.shake_until(lambda: self.now >= end)

    def creep_until(self, condition):
        """Be jogged by somebody else, so slowly that the sliders rest, until something holds."""
        while not condition():
            self.controller.jog((0.0, 0.0, 1e-5), self.now)
            self.look()

    def tell_state(self, state, *, more_stops=0):
        """Let calibration hear a state that the controller has not told."""
        stops = self.leading.machine.stops + more_stops
        self.leading.told(MachineView(state, Cause.COMMAND, "as told", stops))

    def begin(self, course):
        future = Future()
        self.leading.begin(course, future, self.now)
        return future

    def result_of(self, future, most=60.0):
        """Return what a course comes to."""
        self.look_until(future.done, most)
        return future.result()

    def failure_of(self, future, most=60.0):
        """Return why a course has failed, in words."""
        self.look_until(future.done, most)
        with pytest.raises(KinematicsError) as caught:
            future.result()
        return str(caught.value)

    def assert_nothing_moves_on(self):
        """Assert that it comes to rest, and that nothing is done any more."""
        self.look_until(lambda: not self.controller.progress.speed > 0.0)
        before = self.heights, len(self.moves), len(self.twists)
        self.pass_time(3.0)
        assert (self.heights, len(self.moves), len(self.twists)) == before
        self.leading.check_free()
        assert self.listens is None

    def _pass_cycle(self):
        delivery = Delivery(self.now + WALL + PERIOD, self.now + WALL + PERIOD, self.now + PERIOD)
        delivery = delivery._replace(sent=delivery.sent - self.delay)
        if self.is_alive:
            setpoint = self.cycle()
        else:
            self.now += PERIOD
        felt = self._swing.step(self.place, PERIOD)
        self._swung = felt.position
        if self.measures and self.tells_heights:
            stamp = delivery.sent + self.stamp_error
            heights = self.seen or self.measured
            self.leading.measured(heights, stamp, delivery)
        self._tell_contact(delivery)
        if not self.is_alive:
            return
        self._tell_state()
        if self.listens is None:
            return
        if self.tells_setpoints:
            self.leading.leader.setpoints(setpoint, delivery)
        if self.feels:
            x, y, z = (each + self._noise.gauss(0.0, NOISE) for each in felt.acceleration)
            values = (x, y, z + GRAVITY) if self.measures_acceleration else None
            self.leading.leader.sample(values, self.stamp_of(delivery.sent), delivery)

    def _tell_contact(self, delivery):
        is_touched, age = self.plate.is_touched(self.place), self._contact[1] + 1
        if self.has_switch and (is_touched != self._contact[0] or age >= CONTACT_PERIOD):
            self.leading.contact(is_touched, delivery)
            age = 0
        self._contact = is_touched, age

    def _tell_state(self):
        status = self.controller.status
        text = status.reason.text if self.text is None else self.text
        view = MachineView(status.state, status.reason.cause, text, status.stops + 7)
        if view != self._told:
            self._told = view
            self.leading.told(view)
