import numpy as np
import pytest
from motion_machine import LIMITS
from timed_paths import AT_BEGIN, dense_path, random_path, seen

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import plan_window
from tri_glide_kinematics.motion.path_timing.planner import brake
from tri_glide_kinematics.motion.trajectory import check_along


@pytest.mark.parametrize("path", [random_path(4), random_path(7), dense_path(600)])
def test_a_braking_goes_on_smoothly_and_keeps_the_limits(path):
    curve = seen(path)
    window = at_once(plan_window(curve, AT_BEGIN, LIMITS))
    total = float(window.scaling.times[-1])
    found = 0
    for time in np.linspace(0.05 * total, 0.95 * total, 8):
        start = window.on_curve(float(time))
        try:
            braking = at_once(brake(curve, start, LIMITS))
        except PlanningError:
            continue
        found += 1
        begin = tuple(float(values[0]) for values in braking.scaling[1:])
        assert begin == pytest.approx(start, rel=0.0, abs=1e-12)
        assert braking.scaling.speeds[-1] == 0.0
        check_along(curve, braking.scaling, LIMITS)
    # At some instants all that the sliders can do is used already.
    assert found >= 4


def test_a_braking_is_sooner_at_rest_than_the_motion():
    curve = seen(PlatformPath.start((-0.1, 0.0, 0.3)).line_to((0.1, 0.0, 0.3)))
    window = at_once(plan_window(curve, AT_BEGIN, LIMITS))
    total = float(window.scaling.times[-1])
    start = window.on_curve(0.1 * total)
    braking = at_once(brake(curve, start, LIMITS))
    assert braking.ends_at < curve.driven.length
    assert float(braking.scaling.times[-1]) < 0.5 * total


def test_at_rest_there_is_nothing_to_brake():
    curve = seen(random_path(4))
    with pytest.raises(PlanningError, match="rests"):
        at_once(brake(curve, AT_BEGIN, LIMITS))
