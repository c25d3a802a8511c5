import numpy as np
import pytest

from tri_glide_kinematics.errors import OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.motion.limit_use import CommandStream

PERIOD = 0.002


def test_differences_of_a_cubic_are_its_derivatives() -> None:
    jerk = np.array([3.0, -5.0, 0.5])
    times = np.arange(200)[:, np.newaxis] * PERIOD
    stream = CommandStream.from_heights(0.4 + jerk * times**3 / 6.0, PERIOD)

    # The mean over a period belongs to its middle, that of two and three periods likewise.
    np.testing.assert_allclose(
        stream.velocities[1:], jerk * ((times[1:] - PERIOD / 2) ** 2 / 2 + PERIOD**2 / 24)
    )
    np.testing.assert_allclose(stream.accelerations[2:], jerk * (times[2:] - PERIOD), atol=1e-8)
    np.testing.assert_allclose(stream.jerks[3:], np.tile(jerk, (197, 1)), atol=1e-4)


def test_differences_over_unequal_periods_are_means_of_the_derivatives() -> None:
    jerk = np.array([3.0, -5.0, 0.5])
    periods = np.random.default_rng(1).uniform(1e-4, 5e-2, 200)
    times = np.cumsum(periods)[:, np.newaxis]
    stream = CommandStream.from_heights(0.4 + jerk * times**3 / 6.0, periods)
    np.testing.assert_allclose(stream.times, times[:, 0] - times[0, 0])
    np.testing.assert_allclose(stream.jerks[3:], np.tile(jerk, (197, 1)), atol=1e-4)
    # The divided difference of a cubic has the mean of its three places.
    mean = (times[2:] + times[1:-1] + times[:-2]) / 3.0
    np.testing.assert_allclose(stream.accelerations[2:], jerk * mean, atol=1e-8)
    speeds = jerk * times**2 / 2.0
    assert (np.abs(stream.velocities[1:]) <= np.abs(speeds[1:])).all()
    assert (np.abs(stream.velocities[1:]) >= np.abs(speeds[:-1])).all()


def test_rows_without_predecessors_are_zero_and_a_part_keeps_its_rows() -> None:
    stream = CommandStream.from_heights(np.linspace(0.0, 1.0, 30).reshape(10, 3) ** 2, PERIOD)
    assert not stream.velocities[:1].any()
    assert not stream.accelerations[:2].any()
    assert not stream.jerks[:3].any()
    part = stream.part(4, 7)
    np.testing.assert_array_equal(part.times, np.array([4, 5, 6]) * PERIOD)
    np.testing.assert_array_equal(part.jerks, stream.jerks[4:7])


def test_bad_input_is_refused() -> None:
    with pytest.raises(WrongShapeError, match=r"heights has shape \(4, 2\), expected \(n, 3\)"):
        CommandStream.from_heights(np.zeros((4, 2)), PERIOD)
    with pytest.raises(OutOfBoundsError, match="period = 0 s must be greater than 0 s"):
        CommandStream.from_heights(np.zeros((4, 3)), 0.0)
    with pytest.raises(OutOfBoundsError, match="period = -1 s must be greater than 0 s"):
        CommandStream.from_heights(np.zeros((4, 3)), (0.0, 1.0, -1.0, 1.0))
    with pytest.raises(WrongShapeError, match=r"period has shape \(3,\)"):
        CommandStream.from_heights(np.zeros((4, 3)), np.ones(3))
