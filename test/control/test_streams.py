"""When twists are listened to, and when their silence ends a jog."""

import pytest

from tri_glide_kinematics.control import (
    LEAST_PAUSE,
    SLOWEST_STREAM,
    Cause,
    CommandRefusedError,
    ProgramRuns,
    Reason,
    Streams,
    ToldRun,
)

TIMEOUT, START = 0.1, 50.0


def twists_with(timeout):
    return Streams.with_timeouts(timeout, 1.0).twists


def test_a_jog_ends_when_no_twist_was_accepted_for_longer_than_the_timeout():
    twists = twists_with(TIMEOUT)
    assert twists.silence(START) is not None
    twists.accept(START)
    assert twists.silence(START + 0.99 * TIMEOUT) is None
    expected = Reason(Cause.TWISTS_SILENT, "no twist for 0.1 s")
    assert twists.silence(START + 1.01 * TIMEOUT) == expected


def test_twists_that_are_not_accepted_do_not_keep_a_jog_going():
    twists = twists_with(TIMEOUT)
    twists.accept(START)
    for step in range(20):
        twists.receive(START + 0.05 * step, released=False)
    assert twists.silence(START + 0.95) is not None


@pytest.mark.parametrize(
    ("released", "pause", "listens"),
    [
        (False, 1.5 * TIMEOUT, False),
        (False, 0.9 * LEAST_PAUSE, False),
        (True, 0.5 * TIMEOUT, True),
        (False, 1.1 * LEAST_PAUSE, True),
    ],
)
def test_after_a_stop_a_release_or_a_pause_is_needed(released, pause, listens):
    twists = twists_with(TIMEOUT)
    twists.receive(START, released=False)
    twists.need_release()
    assert twists.receive(START + pause, released) == pytest.approx(pause)
    if listens:
        twists.check_released()
    else:
        with pytest.raises(CommandRefusedError, match=r"a pause of 0\.5 s"):
            twists.check_released()


def test_only_a_stream_that_is_too_slow_is_remarked():
    twists = twists_with(TIMEOUT)
    assert "twist_timeout, 0.1 s" in twists.remark(1.5 * TIMEOUT)
    for pause in (0.5 * TIMEOUT, TIMEOUT, SLOWEST_STREAM, float("inf")):
        assert twists.remark(pause) == ""


def test_a_pause_in_which_nobody_looked_is_no_release():
    twists = twists_with(TIMEOUT)
    twists.receive(START)
    twists.need_release()
    twists.looked_at = START + 0.01
    # The node itself stood still; the sender may have sent all the time.
    assert twists.receive(START + 2.0 * LEAST_PAUSE) == pytest.approx(2.0 * LEAST_PAUSE)
    with pytest.raises(CommandRefusedError):
        twists.check_released()
    twists.looked_at = START + 3.5 * LEAST_PAUSE
    twists.receive(START + 3.6 * LEAST_PAUSE)
    twists.check_released()


def test_a_stream_that_may_be_slow_needs_a_longer_pause():
    twists = twists_with(2.0 * LEAST_PAUSE)
    twists.receive(START)
    twists.need_release()
    twists.receive(START + 1.5 * LEAST_PAUSE)
    with pytest.raises(CommandRefusedError, match=r"a pause of 1 s"):
        twists.check_released()


def test_a_command_that_was_held_up_is_refused_whatever_the_clocks():
    twists = twists_with(TIMEOUT)
    for number in range(50):
        # By a clock that is far behind.
        twists.receive(START + 0.02 * number)
        twists.check_age(900.0 + 0.001 * (number % 3))
    with pytest.raises(CommandRefusedError, match=r"0\.3 s older than the quickest"):
        twists.check_age(900.3)
    twists.check_age(float("nan"))
    # Another sender, after a pause.
    twists.receive(START + 1.0 + 1.1 * LEAST_PAUSE)
    twists.check_age(905.0)


def looks(runs, begin, end, period=0.01):
    """Look in each cycle between two times; return when a run was lost, and why."""
    times = [begin + period * count for count in range(round((end - begin) / period) + 1)]
    return [(time, reason) for time in times if (reason := runs.lost(time)) is not None]


def test_a_run_that_is_told_no_more_is_lost_once_and_one_that_has_ended_is_not():
    runs = ProgramRuns(1.0)
    assert runs.lost(START) is None
    runs.tell(1, ToldRun("part.gcode, line 7", ["spindle is 0"]), has_ended=False)
    runs.tell(2, ToldRun("other.gcode", ["flood is 0"]), has_ended=False)
    assert looks(runs, START, START + 0.95) == []
    runs.tell(2, ToldRun("other.gcode", ["flood is 0"]), has_ended=False)
    (time, reason), *others = looks(runs, START + 0.96, START + 1.8)
    assert time == pytest.approx(START + 1.0, abs=0.12)
    text = "what drives part.gcode, line 7 has told nothing for 1 s"
    assert (reason, others) == (Reason(Cause.PROGRAM_LOST, text), [])
    assert runs.safe_outputs == ["spindle is 0"]
    runs.tell(2, ToldRun("other.gcode", ["flood is 0"]), has_ended=True)
    assert looks(runs, START + 1.81, START + 9.0) == []


def test_while_nobody_looks_no_run_is_lost():
    runs = ProgramRuns(1.0)
    assert runs.lost(START) is None
    runs.tell(1, ToldRun("part.gcode", ()), has_ended=False)
    assert looks(runs, START, START + 0.5) == []
    # What came in meanwhile is read after the first cycle.
    assert runs.lost(START + 60.0) is None
    runs.tell(1, ToldRun("part.gcode", ()), has_ended=False)
    assert looks(runs, START + 60.01, START + 60.9) == []
    assert len(looks(runs, START + 60.91, START + 61.2)) == 1
