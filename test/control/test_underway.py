"""What the motors have got of the setpoints, some time after these were sent."""

import pytest
from controller_rig import MACHINE, Rig, controller_of

from tri_glide_kinematics.control import IDLE, MOVING, Underway
from tri_glide_kinematics.motion import MotionKind
from tri_glide_kinematics.motion.engine import Follow, PathOutputs
from tri_glide_kinematics.motion.path import FlatPath

PERIOD, DELAY = 0.002, 0.06
PLACE = (0.0, 0.0, 0.25)
START = MACHINE.inverse(PLACE)
CORNERS = [(0.02, 0.0, 0.25), (0.02, 0.02, 0.25), (0.0, 0.02, 0.25), PLACE]
SQUARE = FlatPath.of([0] * 4, [x for corner in CORNERS for x in corner], (), (), 0.001)
AT_EACH = PathOutputs((0, 1, 2, 3), ("a", "b", "c", "d"), 4)


class Delayed(Rig):
    """A machine whose sliders are where they were told to be, one delay later."""

    def __init__(self, **named):
        self.told = []
        super().__init__(**named)
        self.controller = controller_of(
            self.engine, self.statuses.append, self.refusals.append, drive_delay=DELAY
        )

    @property
    def heights(self):
        then = self.now - DELAY + 1e-9
        while len(self.told) > 1 and self.told[1][0] <= then:
            self.told.pop(0)
        return self.told[0][1]

    @heights.setter
    def heights(self, heights):
        self.told.append((self.now, heights))

    @property
    def error(self):
        return self.controller._supervisor.tracking_error


def test_the_setpoint_at_the_motors_is_that_of_then():
    underway = Underway(0.06)
    assert underway.at_motors(0.0) is None
    for count in range(200):
        underway.send((0.6 + 0.002 * count, 0.6, 0.5), PERIOD * count)
    now = PERIOD * 199
    assert underway.at_motors(now) == pytest.approx((0.6 + 0.002 * 169, 0.6, 0.5))
    assert underway.at_motors(now + 0.0005) == pytest.approx((0.6 + 0.002 * 169.25, 0.6, 0.5))
    assert underway.at_motors(now + 1.0) == (0.6 + 0.002 * 199, 0.6, 0.5)
    assert underway.moves
    underway.clear()
    assert underway.at_motors(now) is None


def test_sliders_that_follow_later_at_full_speed_are_in_no_fault():
    rig = Delayed()
    rig.cycle(60)
    rig.controller.move_to((0.0, 0.0, 0.1))
    speeds = []
    for _ in range(1000):
        before = rig.heights
        rig.cycle()
        speeds.append(abs(rig.heights[0] - before[0]) / PERIOD)
        # 60 mm, if they were compared with the newest one.
        assert rig.error < 1e-6
    assert max(speeds) > 0.9
    assert rig.controller.state is IDLE


def test_a_target_is_reached_and_a_stop_over_when_the_motors_are_there():
    rig = Delayed()
    rig.cycle(60)
    rig.controller.move_to((0.0, 0.0, 0.25))
    rig.cycle()
    while not rig.controller.rests:
        setpoint = rig.cycle()
        assert rig.controller.state is MOVING
    assert rig.heights == pytest.approx(setpoint.heights, abs=1e-12)
    rig.cycle_until(IDLE)
    rig.controller.move_to((0.0, 0.0, 0.3))
    rig.cycle(100)
    rig.controller.disable()
    while rig.controller.leads:
        setpoint = rig.cycle() or setpoint
    # No setpoint is missing to the motors when they cease.
    assert rig.heights == setpoint.heights


def test_outputs_on_a_path_change_when_the_sliders_get_there():
    found = {}
    for machine in (Rig, Delayed):
        rig = machine(kind=MotionKind.LINEAR, in_pieces=True, start=START)
        rig.pieces = 30
        rig.cycle(60)
        begin = rig.now
        path = Follow.made(lambda _: SQUARE.path_from(PLACE), "square", False, AT_EACH)
        goal = rig.controller.pursue(path)
        while goal.outcome is None:
            rig.cycle()
            for output in rig.controller.passed_outputs:
                found.setdefault(output, []).append(rig.now - begin)
            rig.controller.passed_outputs.clear()
    assert set(found) == set("abcd")
    for at_setpoint, at_motors in found.values():
        assert at_motors - at_setpoint == pytest.approx(DELAY, abs=1.5 * PERIOD)


def test_an_output_that_was_under_way_when_the_lead_ended_does_not_change_at_the_next():
    underway = Underway(DELAY)
    underway.send(PLACE, 1.0)
    underway.pass_output("a")
    underway.clear()
    underway.send(PLACE, 2.0 + DELAY)
    assert not underway.passed_outputs()
