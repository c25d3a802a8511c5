import numpy as np
import pytest
from strategies import DEFAULT_LIMITS

from tri_glide_kinematics.calibration import NoMovesError, exciting_moves
from tri_glide_kinematics.checks import OutOfBoundsError
from tri_glide_kinematics.dynamics import Masses, SliderForces, identify
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import OutsideWorkspaceError, Workspace, WorkspaceLimits

MACHINE = TriGlide(DEFAULT_GEOMETRY)
REGION = Workspace(MACHINE, DEFAULT_LIMITS)
LIMITS = SliderLimits((1.0,) * 3, (10.0,) * 3, (200.0,) * 3)


def test_moves_are_verified_and_tell_masses_and_friction():
    found = exciting_moves(REGION, LIMITS, 5.0, start=(0.0, 0.0, 0.2))
    trajectory = found.trajectory
    assert 5.0 <= trajectory.duration < 7.0
    assert found.positions[0] == (0.0, 0.0, 0.2)
    trajectory.check_limits(LIMITS)
    trajectory.check_inside(REGION, LIMITS)
    setpoints = trajectory.sample(np.arange(0.0, trajectory.duration, 0.01))
    assert MACHINE.forward(setpoints.heights[0]) == pytest.approx(found.positions[0])
    masses = Masses.uniform(1.0, 0.5, 0.6, coulomb=4.0, viscous=9.0)
    efforts = SliderForces(MACHINE, masses).forces_batch(*setpoints[1:])
    noise = 0.02 * np.abs(efforts).max() * np.random.default_rng(0).normal(size=efforts.shape)
    identified = identify(MACHINE, *setpoints[1:], efforts + noise)
    values = identified.values
    assert values["platform"] == pytest.approx(0.6, rel=0.05)
    assert values["carriage 2"] == pytest.approx(1.0, rel=0.05)
    assert values["dry friction 3"] == pytest.approx(4.0, rel=0.05)


def test_a_seed_gives_the_same_moves_again():
    first, second = (exciting_moves(REGION, LIMITS, 1.0, seed=3) for _ in range(2))
    assert first.positions == second.positions
    assert exciting_moves(REGION, LIMITS, 1.0, seed=4).positions != first.positions


def test_a_start_outside_is_refused_and_so_is_a_workspace_without_places():
    with pytest.raises(OutsideWorkspaceError):
        exciting_moves(REGION, LIMITS, 1.0, start=(0.0, 0.0, 2.0))
    small = WorkspaceLimits(
        (0.3,) * 3, (0.9,) * 3, 0.005, 10.0, (0.0, 0.0, 0.2), (1e-6, 1e-6, 0.2 + 1e-6)
    )
    with pytest.raises(NoMovesError, match="of 1000 places at random, none"):
        exciting_moves(Workspace(MACHINE, small), LIMITS, 1.0)


def test_a_duration_beyond_an_hour_is_refused():
    with pytest.raises(OutOfBoundsError, match="3600"):
        exciting_moves(REGION, LIMITS, 3601.0)
