import math

import pytest

from tri_glide_kinematics.control import SILENT_CYCLES, Cause, SupervisionBounds, Supervisor

BOUNDS = SupervisionBounds(timeout=0.2, jump=0.02, tracking_error=0.05, velocity=(1.0, 1.0, 2.0))
NAMES = ("slider_1", "slider_2", "slider_3")
REST = (0.6, 0.6, 0.6)


@pytest.fixture
def supervisor():
    return Supervisor(BOUNDS, NAMES)


def test_a_machine_that_follows_is_fine(supervisor):
    for k in range(1000):
        now = 0.002 * k
        heights = (0.6 + 0.3 * math.sin(now), 0.6, 0.6)
        assert supervisor.measured(heights, heights, now) is None
        assert supervisor.cycle(now) is None


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("slider", range(3))
def test_not_finite(supervisor, slider, value):
    heights = list(REST)
    heights[slider] = value
    reason = supervisor.measured(heights, REST, 0.0)
    assert reason.cause is Cause.MEASUREMENT_NOT_FINITE
    assert f"slider_{slider + 1} is {value}" in reason.text
    # What comes after it is no jump: there is nothing to compare it with.
    assert supervisor.measured((0.64, 0.6, 0.6), REST, 0.002) is None


def test_jump_beyond_what_the_velocity_explains(supervisor):
    assert supervisor.measured(REST, REST, 0.0) is None
    # 10 ms at 1 m/s explain 10 mm, at 2 m/s 20 mm.
    assert supervisor.measured((0.6, 0.629, 0.639), REST, 0.01) is None
    reason = supervisor.measured((0.6, 0.598, 0.639), REST, 0.02)
    assert "slider_2 jumped by -0.031 m in 0.01 s, more than 0.03 m" in reason.text


def test_a_jump_between_two_senders_names_them():
    supervisor = Supervisor(BOUNDS, NAMES, lambda: ["/drives", "/other"])
    supervisor.measured(REST, REST, 0.0)
    reason = supervisor.measured((0.6, 0.5, 0.6), REST, 0.002)
    assert reason.cause is Cause.MEASUREMENT_JUMP
    assert reason.text.endswith(", more than 0.022 m; /drives and /other send heights")


def test_measurements_that_waited_in_a_queue_are_no_jump(supervisor):
    assert supervisor.measured(REST, REST, 1.0, stamp=50.0) is None
    # 40 mm in 40 ms at 1 m/s are fine, even if both come in within a millisecond.
    assert supervisor.measured((0.64, 0.6, 0.6), (0.64, 0.6, 0.6), 1.0003, stamp=50.04) is None
    # A stamp from far ahead explains nothing, and neither does one from the past.
    moved = (0.68, 0.6, 0.6)
    jump = Cause.MEASUREMENT_JUMP
    assert supervisor.measured(moved, moved, 1.0006, stamp=60.0).cause is jump
    back = (0.64, 0.6, 0.6)
    assert supervisor.measured(back, back, 1.0009, stamp=0.0).cause is jump


def test_restart_forgets_the_last_heights(supervisor):
    supervisor.measured(REST, None, 0.0)
    supervisor.restart()
    assert supervisor.measured((0.9, 0.3, 0.6), None, 0.002) is None


def test_disagreement_with_the_command(supervisor):
    assert supervisor.measured(REST, (0.6, 0.6, 0.649), 0.0) is None
    assert supervisor.tracking_error == pytest.approx(0.049)
    reason = supervisor.measured(REST, (0.6, 0.6, 0.651), 0.002)
    assert reason.cause is Cause.TRACKING_ERROR
    text = "slider_3 is measured at 0.6 m, but commanded to 0.651 m: 0.051 m apart"
    assert text in reason.text


def test_silence_counts_only_while_we_listen(supervisor):
    supervisor.measured(REST, REST, 10.0)
    assert supervisor.cycle(10.2) is None
    # One late cycle of our own; the measurement that waited meanwhile is read after it.
    assert supervisor.cycle(10.5) is None
    supervisor.measured(REST, REST, 10.5)
    assert supervisor.cycle(10.502) is None
    reasons = [supervisor.cycle(11.0 + 0.002 * k) for k in range(SILENT_CYCLES)]
    assert reasons[:-1] == [None] * (SILENT_CYCLES - 1)
    assert reasons[-1].cause is Cause.MEASUREMENTS_SILENT
    assert "silent for 0.504 s, more than 0.2 s" in reasons[-1].text


def test_nothing_is_fresh_before_the_first_measurement(supervisor):
    assert not supervisor.is_fresh(0.0)
    supervisor.measured(REST, None, 1.0)
    assert supervisor.is_fresh(1.2)
    assert not supervisor.is_fresh(1.21)
