"""Probes that lead a controller down to a plate and back, in the time of its cycles."""

import re
from itertools import pairwise

import pytest
from controller_rig import MACHINE
from led_machine import CYCLES, PERIOD, WALL, LedMachine

from tri_glide_kinematics.calibration.session import BACK_TOLERANCE, Delivery, ProbeSettings, probe
from tri_glide_kinematics.control import (
    DISABLED,
    FAULT,
    IDLE,
    JOGGING,
    MOVING,
    PAUSED,
    STOPPING,
    TRACKING,
    WAS_STOPPED,
    Cause,
)
from tri_glide_kinematics.simulation import SimulatedPlate

PLATE = 0.2
ABOVE = (0.03, -0.02, PLATE + 0.003)
SETTINGS = ProbeSettings(speed=0.005, depth=0.01, contact_timeout=0.5)
# At 5 mm/s the platform moves by 10 µm from one measurement to the next.
EXACT = 1e-5
LOOK = CYCLES * PERIOD


@pytest.fixture
def machine():
    return LedMachine(ABOVE, plate=PLATE)


def begin(machine, settings=SETTINGS):
    return machine.begin(probe(machine.leading, machine, machine.believed.position, settings))


def on_its_way_down(machine, settings=SETTINGS):
    future = begin(machine, settings)
    machine.look_until_state(JOGGING)
    machine.pass_time(0.2)
    return future


def on_its_way_back(machine):
    future = begin(machine)
    machine.look_until(lambda: machine.twists and machine.twists[-1][1] > 0.0)
    machine.look_until(lambda: machine.place[2] > PLATE + 0.001)
    return future


def between_both_ways(machine):
    future = on_its_way_down(machine)
    machine.look_until(lambda: machine.twists[-1][1] == 0.0)
    return future


def refused(machine, settings=SETTINGS):
    """Return why a probe is refused; nothing may have been sent."""
    failure = machine.failure_of(begin(machine, settings))
    assert not machine.twists
    return failure


def test_a_probe_finds_the_plate_and_comes_back(machine):
    lowest, looks = [ABOVE[2]], []

    def look():
        lowest.append(machine.place[2])
        looks.append(len(machine.twists))
        return future.done()

    future = begin(machine)
    machine.look_until(look)
    result = future.result()
    x, y, z = MACHINE.forward(result.heights)
    assert (x, y) == pytest.approx(ABOVE[:2], abs=1e-6)
    assert z == pytest.approx(PLATE, abs=EXACT)
    assert 0.0 < result.overrun < 2e-4
    assert z - result.overrun == pytest.approx(min(lowest), abs=1e-6)
    assert result.text == ""
    assert machine.place == pytest.approx(ABOVE, abs=2.0 * BACK_TOLERANCE)
    # It begins with a stop, so that ik_node listens; and each twist is renewed in time.
    times, speeds = zip(*machine.twists)
    down = speeds.index(-SETTINGS.speed)
    stop = speeds.index(0.0, down)
    assert set(speeds[:down]) == {0.0} == {speeds[-1]}
    assert set(speeds[down:stop]) == {-SETTINGS.speed}
    assert min(speeds[stop:]) >= 0.0
    assert max(later - time for time, later in pairwise(times)) < 0.02 + 2 * LOOK
    assert machine.refusals == []
    machine.assert_nothing_moves_on()


def test_a_contact_was_made_before_its_message_was_sent(machine):
    delay = 0.02
    result = machine.result_of(begin(machine, ProbeSettings(0.005, 0.01, 0.5, delay)))
    assert MACHINE.forward(result.heights)[2] == pytest.approx(PLATE + 0.005 * delay, abs=EXACT)


def test_heights_by_another_clock_have_the_time_at_which_they_were_sent(machine):
    machine.stamp_error = 1e5
    result = machine.result_of(begin(machine))
    assert MACHINE.forward(result.heights)[2] == pytest.approx(PLATE, abs=EXACT)


def test_a_contact_by_another_clock_counts_for_nothing(machine):
    machine.has_switch = False
    future = on_its_way_down(machine)
    machine.leading.contact(True, Delivery(0.0, WALL + machine.now, machine.now))
    assert machine.failure_of(future).startswith("no measured heights from before and after the")
    assert machine.place == pytest.approx(ABOVE, abs=2.0 * BACK_TOLERANCE)


def test_without_a_contact_it_comes_back(machine):
    heights, future = [], begin(machine, ProbeSettings(0.005, 0.001, 0.5))
    machine.look_until(lambda: heights.append(machine.place[2]) or future.done())
    assert machine.failure_of(future) == "no contact on 1 mm"
    assert min(heights) == pytest.approx(ABOVE[2] - 0.001, abs=2e-4)
    assert machine.controller.state is IDLE
    assert machine.place == pytest.approx(ABOVE, abs=2.0 * BACK_TOLERANCE)


def test_a_contact_that_does_not_open_again_is_told_with_the_touch(machine):
    future = on_its_way_down(machine)
    machine.look_until_state(STOPPING)
    machine.pass_time(0.05)
    machine.has_switch = False
    result = machine.result_of(future)
    assert result.text == "the contact does not open again"
    assert MACHINE.forward(result.heights)[2] == pytest.approx(PLATE, abs=EXACT)


def test_the_way_back_needs_no_height_offsets():
    """Calibration believes in others than ik_node, by 5 mm."""
    machine = LedMachine(ABOVE, plate=PLATE, offsets=(-0.005,) * 3)
    heights, future = [], begin(machine)
    machine.look_until(lambda: heights.append(machine.place[2]) or future.done())
    assert future.result().text == ""
    assert PLATE - 2e-4 < min(heights) < PLATE
    assert max(heights) < ABOVE[2] + 2.0 * BACK_TOLERANCE
    assert machine.place == pytest.approx(ABOVE, abs=2.0 * BACK_TOLERANCE)


def test_without_a_switch_nothing_moves():
    machine = LedMachine(ABOVE, has_switch=False)
    assert refused(machine) == "no message has come on the topic contact yet"


def test_a_switch_that_is_silent_is_not_relied_on(machine):
    machine.has_switch = False
    machine.pass_time(0.7)
    assert re.fullmatch(r"contact is silent for 0\.7\d* s", refused(machine))
    # One that tells of changes only may be.
    machine.has_switch = True
    machine.result_of(begin(machine, ProbeSettings(0.005, 0.01, 0.0)))


def test_a_contact_that_is_closed_already_is_refused(machine):
    machine.plate = SimulatedPlate(1.0, 0.0, 0.0)
    machine.look()
    assert refused(machine) == "the contact is closed already: move the platform up first"


def test_without_ik_node_nothing_moves(machine):
    machine.is_there = False
    assert refused(machine) == "there is no ik_node that could move the platform"


def test_a_machine_that_is_not_idle_is_left_alone(machine):
    machine.controller.disable()
    machine.pass_time(0.1)
    assert refused(machine).startswith("ik_node is disabled: ")


def test_one_who_jogs_is_left_to_it(machine):
    machine.creep_until(lambda end=machine.now + 0.1: machine.now > end)
    future = begin(machine)
    machine.creep_until(future.done)
    assert machine.failure_of(future).startswith("ik_node is jogging: ")
    assert not machine.twists


def test_sliders_that_move_are_no_place_to_probe_from(machine):
    machine.shake(0.01)
    future, begun = begin(machine), machine.now
    machine.shake_until(future.done)
    assert machine.failure_of(future).startswith("slider 1 moves: by 0.002 m in the last 0.2 s")
    assert not machine.twists
    assert machine.now - begun == pytest.approx(1.0, abs=2 * LOOK)


@pytest.mark.parametrize(
    ("stop", "words"),
    [
        (lambda machine: machine.leading.stop(), "stop was asked for"),
        (lambda machine: machine.controller.stop(), WAS_STOPPED),
    ],
)
def test_a_stop_while_a_probe_waits_for_rest_is_remembered(machine, stop, words):
    machine.shake(0.01)
    future = begin(machine)
    machine.shake(0.3)
    stop(machine)
    assert machine.failure_of(future) == words
    assert not machine.twists


def test_nobody_else_is_let_while_a_probe_is_under_way(machine):
    future = on_its_way_down(machine)
    assert machine.failure_of(begin(machine)) == "a probe is under way"
    machine.result_of(future)


def test_somebody_else_who_leads_the_platform_is_left_to_it(machine):
    future = on_its_way_down(machine)
    machine.send_pose((-0.04, 0.02, 0.25))
    assert machine.failure_of(future) == "another node sends a target pose"
    count = len(machine.twists)
    machine.look_until_state(IDLE)
    assert len(machine.twists) == count
    assert machine.place == pytest.approx((-0.04, 0.02, 0.25))


STUCK = MACHINE.inverse((0.03, -0.02, PLATE + 0.0025))


@pytest.mark.parametrize(
    ("wrong", "words", "comes_back"),
    [
        ({"has_switch": False}, "nothing about the contact for 0.5 s", True),
        ({"seen": STUCK}, "the platform does not go down: ik_node is jogging: ", True),
        ({"tells_heights": False}, "no measured heights for 0.5 s", False),
        (
            {"seen": MACHINE.inverse((0.033, -0.02, PLATE + 0.0025))},
            "the platform is 3 mm away from its way down: somebody else leads it",
            False,
        ),
    ],
)
def test_what_goes_wrong_on_the_way_down_ends_it(machine, wrong, words, comes_back):
    machine.plate = SimulatedPlate(0.0, 0.0, 0.0)
    future = on_its_way_down(machine, ProbeSettings(0.005, 1.0, 0.5))
    vars(machine).update(wrong)
    assert machine.failure_of(future).startswith(words)
    assert any(speed > 0.0 for _, speed in machine.twists) is comes_back
    assert machine.twists[-1][1] == (0.0 if comes_back else -0.005)


def test_heights_without_a_place_are_no_progress(machine):
    machine.plate = SimulatedPlate(0.0, 0.0, 0.0)
    future = on_its_way_down(machine)
    # No arms are so long.
    machine.seen = (0.1, 0.9, 0.9)
    assert machine.failure_of(future) == "no measured heights for 0.5 s"


@pytest.mark.parametrize("begun", [on_its_way_down, on_its_way_back])
@pytest.mark.parametrize(
    ("state", "words"),
    [
        (MOVING, "ik_node is moving: as told"),
        (TRACKING, "ik_node is tracking: as told"),
        (PAUSED, "ik_node is paused: as told"),
        (FAULT, "ik_node is fault: as told"),
        (DISABLED, "ik_node is disabled: as told"),
        (STOPPING, "it was stopped: as told"),
        (IDLE, "it was stopped: as told"),
        (None, "ik_node is not heard yet: as told"),
    ],
)
def test_who_else_leads_the_machine_is_left_to_it(machine, begun, state, words):
    future = begun(machine)
    count = len(machine.twists)
    machine.tell_state(state)
    # Of several reasons the first counts.
    machine.tell_state(MOVING)
    machine.look()
    assert future.done()
    assert len(machine.twists) == count
    if begun is on_its_way_back:
        assert future.result().text == words
    else:
        assert machine.failure_of(future) == words


@pytest.mark.parametrize("state", [STOPPING, IDLE])
def test_a_stop_between_the_way_down_and_the_way_back_ends_it(machine, state):
    future = between_both_ways(machine)
    machine.tell_state(state, more_stops=1)
    assert machine.result_of(future).text == WAS_STOPPED
    assert not any(speed > 0.0 for _, speed in machine.twists)


def test_time_in_which_nobody_listened_is_no_silence(machine):
    future = on_its_way_down(machine)
    machine.has_switch = machine.tells_heights = False
    machine.hold_up(0.4)
    machine.has_switch = machine.tells_heights = True
    assert machine.result_of(future).text == ""


@pytest.mark.parametrize(("timeout", "gap"), [(0.5, 3.0), (0.5, 0.6), (0.0, 0.6), (0.2, 0.3)])
def test_a_probe_that_was_held_up_itself_ends(machine, timeout, gap):
    machine.plate = SimulatedPlate(0.0, 0.0, 0.0)
    future = on_its_way_down(machine, ProbeSettings(0.005, 0.01, timeout))
    count = len(machine.twists)
    machine.hold_up(gap)
    assert re.match("this node was held up for", machine.failure_of(future))
    assert len(machine.twists) == count


def test_a_contact_that_closes_on_the_way_back_is_told_with_a_stop(machine):
    future = on_its_way_back(machine)
    machine.plate = SimulatedPlate(1.0, 0.0, 0.0)
    assert machine.result_of(future).text == "the contact closes on the way back"
    assert machine.twists[-1][1] == 0.0
    assert machine.place[2] < PLATE + 0.0015


def test_a_platform_that_moves_down_on_its_way_back_is_told_with_a_stop(machine):
    future = on_its_way_back(machine)
    x, y, z = machine.place
    machine.seen = MACHINE.inverse((x, y, z - 4e-4))
    assert machine.result_of(future).text == "the platform moves down on its way back"
    assert machine.twists[-1][1] == 0.0
    assert machine.place[2] < PLATE + 0.0015


def test_a_platform_that_does_not_come_back_is_told(machine):
    """Its touch counts, though measurements are not kept for so long."""
    future = on_its_way_back(machine)
    machine.seen = machine.heights
    result = machine.result_of(future)
    assert result.text.startswith("the platform is not back after 15.3 s: ik_node is jogging: ")
    assert MACHINE.forward(result.heights)[2] == pytest.approx(PLATE, abs=EXACT)


def test_sliders_that_do_not_come_to_rest_are_told(machine):
    future = between_both_ways(machine)
    begun = machine.now
    machine.shake_until(future.done)
    assert future.result().text == "the sliders do not come to rest within 5 s"
    assert machine.now - begun == pytest.approx(5.0, abs=4 * LOOK)


@pytest.mark.parametrize("begun", [on_its_way_down, on_its_way_back])
def test_our_own_stop_ends_a_probe(machine, begun):
    future = begun(machine)
    assert machine.leading.stop()
    machine.look()
    assert future.done()
    place = machine.place
    machine.assert_nothing_moves_on()
    # Without twists ik_node stops.
    assert machine.place == pytest.approx(place, abs=2e-3)
    assert machine.controller.reason.cause is Cause.TWISTS_SILENT
    assert not machine.leading.stop()
    if begun is on_its_way_down:
        assert machine.failure_of(future) == "stop was asked for"
    else:
        assert future.result().text == "stop was asked for"


def test_a_probe_goes_on_where_twists_are_late(machine):
    """It does not read what is meant for people."""
    machine.text = "qzfwkpytnbva"
    # Less than the time from twist to twist: the platform comes to rest before each.
    machine.controller.streams.twists.timeout = 0.012
    machine.result_of(begin(machine))
    assert machine.states.count(STOPPING) > 3
    causes = [each.reason.cause for each in machine.statuses if each.state is STOPPING]
    assert causes.count(Cause.TWISTS_SILENT) > 3


def test_a_switch_and_measurements_that_die_together_end_a_probe(machine):
    future = on_its_way_down(machine)
    machine.has_switch = machine.measures = False
    assert machine.failure_of(future)
    machine.look_until(lambda: not machine.controller.progress.speed > 0.0)
