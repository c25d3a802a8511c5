"""Measured heights of the last seconds."""

import math

import pytest

from tri_glide_kinematics.calibration.session import KEPT, HeightRecord, RecordingError

PERIOD = 0.002
AHEAD = 1e9  # s, of the clock of the machine before our own


def record_of(heights, count=500):
    """Return a record of ``heights``, a function of time, and the time of its end."""
    record = HeightRecord()
    for step in range(count):
        now = PERIOD * step
        record.add(heights(now), AHEAD + now, now)
    return record, PERIOD * (count - 1)


def falling(now):
    return (0.6 - 0.01 * now, 0.6 - 0.02 * now, 0.6)


def test_resting_heights_are_a_mean():
    record, end = record_of(lambda now: (0.6, 0.5 + 1e-6 * math.sin(1000.0 * now), 0.4))
    assert record.resting(end) == pytest.approx((0.6, 0.5, 0.4), abs=2e-7)


@pytest.mark.parametrize("count", [0, 2, 50])
def test_too_few_are_told(count):
    record, end = record_of(lambda now: (0.6, 0.6, 0.6), count)
    with pytest.raises(RecordingError, match=f"^{count} measured heights in the last 0.2 s"):
        record.resting(end)


def test_silence_is_no_rest():
    record, end = record_of(lambda now: (0.6, 0.6, 0.6))
    with pytest.raises(RecordingError, match=r"^0 measured heights"):
        record.resting(end + 1.0)


def test_heights_between_two_measurements():
    record, end = record_of(falling)
    for now in (0.0, 0.1, 0.12345, end - 0.001, end):
        assert record.at(AHEAD + now) == pytest.approx(falling(now), abs=1e-8)


@pytest.mark.parametrize("stamp", [AHEAD - 1.0, AHEAD + 2.0, 0.0])
def test_times_outside_of_the_record_are_refused(stamp):
    record, _ = record_of(falling)
    with pytest.raises(RecordingError, match="clocks"):
        record.at(stamp)


def test_a_clock_that_is_set_back_begins_anew():
    record, end = record_of(falling)
    record.add((0.1, 0.2, 0.3), 5.0, end + PERIOD)
    assert record.at(5.0) == (0.1, 0.2, 0.3)
    with pytest.raises(RecordingError, match="clocks"):
        record.at(AHEAD + 0.1)


def test_what_is_not_finite_is_left_out_and_what_is_old_is_forgotten():
    record, end = record_of(falling)
    record.add((math.nan, 0.6, 0.6), AHEAD + 2.0, 2.0)
    assert record.at(AHEAD + end) == pytest.approx(falling(end))
    with pytest.raises(RecordingError, match="clocks"):
        record.at(AHEAD + 2.0)
    record.add((0.6, 0.6, 0.6), AHEAD + 3.0 + KEPT, 3.0 + KEPT)
    with pytest.raises(RecordingError, match="clocks"):
        record.at(AHEAD + 0.5)
