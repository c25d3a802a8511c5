import numpy as np
import pytest
from motion_machine import LIMITS
from timed_paths import AT_BEGIN, dense_path, random_path, seen

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.motion.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import plan_window
from tri_glide_kinematics.motion.trajectory import Bounds, blocks, check_along, derivative_bounds
from tri_glide_kinematics.motion.trajectory import curve_bounds as module

PATHS = [*map(random_path, range(6)), dense_path(150)]


def planned(path):
    curve = seen(path)
    return curve, at_once(plan_window(curve, AT_BEGIN, LIMITS)).scaling


def sampled(curve, scaling, count=24):
    """Return velocity, acceleration and jerk within all pieces. Shape (3, 3, count, k)."""
    x = (np.arange(count) + 0.5)[:, np.newaxis] / count
    dt = np.diff(scaling.times)
    t = x * dt
    c = scaling.coefficients()
    way = sum(c[n] * t**n for n in range(6))
    speed = sum(n * c[n] * t ** (n - 1) for n in range(1, 6))
    acceleration = sum(n * (n - 1) * c[n] * t ** (n - 2) for n in range(2, 6))
    jerk = sum(n * (n - 1) * (n - 2) * c[n] * t ** (n - 3) for n in range(3, 6))
    h = curve.derivatives(way.ravel()).heights.reshape(4, 3, count, -1)
    return np.array(
        (
            h[1] * speed,
            h[1] * acceleration + h[2] * speed**2,
            h[1] * jerk + 3.0 * h[2] * speed * acceleration + h[3] * speed**3,
        )
    )


@pytest.mark.parametrize("path", PATHS)
def test_bounds_are_bounds_and_near(path):
    curve, scaling = planned(path)
    # Half of the knots make pieces with breaks of the path in them.
    rough = type(scaling)(*(np.append(values[:-1:3], values[-1]) for values in scaling))
    for chosen in (rough, scaling):
        bounds = np.array(derivative_bounds(curve, chosen)[:3])
        values = np.abs(sampled(curve, chosen)).max(axis=2)
        assert ((values - bounds) / LIMITS.table[..., np.newaxis]).max() < 1e-9
    # They are little more than what occurs, as far as it matters.
    assert (bounds.max(axis=2) < 1.05 * values.max(axis=2) + 0.02 * LIMITS.table).all()


def test_how_many_pieces_are_bounded_together_makes_no_difference(monkeypatch):
    curve, scaling = planned(dense_path(150))
    together = derivative_bounds(curve, scaling)
    monkeypatch.setattr(module, "_BLOCK", 60)
    found = [derivative_bounds(curve, block) for block in blocks(curve, scaling)]
    assert len(found) > 4
    joined = Bounds.joined(found)
    assert joined.added is together.added is None
    for one, other in zip(joined[:5], together[:5]):
        assert np.asarray(one) == pytest.approx(np.asarray(other), rel=1e-9)


def test_slower_is_the_law_of_scaling():
    curve, scaling = planned(PATHS[1])
    bounds = derivative_bounds(curve, scaling)
    slower = derivative_bounds(curve, scaling.slower(1.3))
    for order, (values, less) in enumerate(zip(bounds[:3], slower[:3]), start=1):
        assert less * 1.3**order == pytest.approx(values, rel=2e-6, abs=1e-5)


def test_what_is_too_fast_is_refused():
    curve, scaling = planned(PATHS[0])
    check_along(curve, scaling, LIMITS)
    faster = scaling.slower(0.98)
    with pytest.raises(SliderLimitError) as refused:
        check_along(curve, faster, LIMITS)
    assert refused.value.value > refused.value.limit
    late = float(faster.times[-3])
    with pytest.raises(SliderLimitError) as refused:
        check_along(curve, faster, LIMITS, since=late)
    assert refused.value.time >= late


def test_a_platform_too_fast_for_the_path_is_refused():
    path = PlatformPath.start((-0.05, 0.0, 0.3)).line_to((0.05, 0.0, 0.3), speed=0.05)
    curve, scaling = planned(path)
    check_along(curve, scaling, LIMITS)
    with pytest.raises(PlanningError, match="as fast as the path asks for"):
        check_along(curve, scaling.slower(0.99), SliderLimits.uniform(2.0, 20.0, 400.0))


def test_the_way_back_is_refused():
    curve, scaling = planned(PATHS[0])
    middle = len(scaling.times) // 2
    scaling.speeds[middle] = -1e-3
    with pytest.raises(PlanningError, match="would go back"):
        check_along(curve, scaling, LIMITS)
