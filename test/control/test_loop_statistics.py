import pytest

from tri_glide_kinematics.control import LoopStatistics


def test_a_regular_loop():
    loop = LoopStatistics(0.002)
    for k in range(501):
        loop.cycle(0.002 * k)
    report = loop.report()
    assert report.rate == pytest.approx(500.0)
    assert report.jitter == pytest.approx(0.0, abs=1e-12)
    assert report.late_cycles == 0


def test_late_cycles_are_counted_and_reports_start_anew():
    loop = LoopStatistics(0.01)
    for now in (0.0, 0.01, 0.024, 0.03, 0.046, 0.05):
        loop.cycle(now)
    report = loop.report()
    assert report.rate == pytest.approx(100.0)
    assert report.largest_delay == pytest.approx(0.006)
    assert report.jitter == pytest.approx((104e-6 / 5) ** 0.5)
    assert report.late_cycles == 1
    loop.cycle(0.06)
    assert loop.report().late_cycles == 0
    assert loop.total_late == 1


def test_no_cycles_at_all():
    assert LoopStatistics(0.01).report() == (0.0, 0.0, 0.0, 0, 0)


def test_a_stall_is_told_with_its_length():
    loop = LoopStatistics(0.002)
    assert loop.cycle(1.0) is None
    assert loop.cycle(1.002) is None
    assert loop.cycle(1.01399) is None
    assert loop.cycle(1.02601) == pytest.approx(0.01002)
    assert loop.cycle(1.52801) == pytest.approx(0.5)
    assert loop.cycle(1.53001) is None
    report = loop.report()
    assert (report.late_cycles, report.stalls) == (3, 2)
    assert loop.report().stalls == 0
    assert loop.histogram[-1] == 2
    assert loop.longest_delay == pytest.approx(0.5)


def test_the_longest_delay_is_kept_though_it_was_no_stall():
    loop = LoopStatistics(0.002)
    for now in (0.0, 0.002, 0.007, 0.009):
        assert loop.cycle(now) is None
    loop.report()
    assert loop.histogram[-1] == 0
    assert loop.longest_delay == pytest.approx(0.003)


def test_each_delay_is_counted_in_its_class():
    loop = LoopStatistics(1.0)
    now = 0.0
    loop.cycle(now)
    for delay in (-0.5, 0.0, 0.1, 0.11, 0.25, 0.3, 0.5, 0.6, 1.0, 1.1, 5.0, 5.1, 40.0):
        # Multiples of a power of two: no rounding moves them into the next class.
        now += 1.0 + round(1024.0 * delay - 0.5) / 1024.0
        loop.cycle(now)
    assert loop.histogram == [3, 2, 2, 2, 2, 2]
    assert (loop.total_late, loop.histogram[-1]) == (6, 2)
    loop.report()
    assert sum(loop.histogram) == 13
