from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import parametrise
from tri_glide_kinematics.motion.moves.line_timing import SpeedNorm
from tri_glide_kinematics.motion.trajectory import StraightLine
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

LIMITS = SliderLimits((1.0, 0.8, 0.9), (10.0, 9.0, 8.0), (200.0, 250.0, 180.0))
ACROSS = StraightLine.between(DEFAULT_GEOMETRY, (-0.12, -0.08, 0.3), (0.1, 0.12, 0.45))
UPRIGHT = StraightLine.between(DEFAULT_GEOMETRY, (0.03, 0.02, 0.2), (0.03, 0.02, 0.4))


def test_ramps_look_at_their_own_part_of_the_line_alone():
    steep_end = StraightLine.between(DEFAULT_GEOMETRY, (0.0, 0.0, 0.3), (0.0, -0.19, 0.3))
    parametrisation = parametrise(steep_end, LIMITS, SpeedNorm(12, 3.0), 0.05)
    begin, end = (parametrisation.ramp_limits(1.0, at_end=at_end) for at_end in (False, True))
    assert begin[0] > 3.0 * end[0]
    assert begin[1] > 3.0 * end[1]
    assert begin[0] <= parametrisation.accelerations[0]
    assert end[0] <= parametrisation.accelerations[-1]
    assert min(begin[0], end[0]) >= parametrisation.accelerations.min()


def test_upright_line_has_no_bends():
    assert parametrise(UPRIGHT, LIMITS, SpeedNorm(6, 1.1)).bend_fraction == 0.0
    assert parametrise(ACROSS, LIMITS, SpeedNorm(6, 1.1)).bend_fraction > 0.1
