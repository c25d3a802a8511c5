"""Bounds that are added to the sliders' limits: how much of them a motion uses, proved in cells."""

from functools import cache

import numpy as np
import pytest

from benchmarks.bench_smoothness import LOWER, UPPER
from benchmarks.judge import LIMITS, MACHINE, WORKSPACE
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import (
    AddedBound,
    AddedBoundError,
    CannotHoldError,
    ForceLimits,
    MotionKind,
    PlatformPath,
    PlatformSpeedLimit,
    SliderLimits,
    Trajectory,
    plan_move,
    time_path,
)
from tri_glide_kinematics.motion.limits import series
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.motion.trajectory import LinePlan, along_curve, bounds_along, cubic
from tri_glide_kinematics.motion.trajectory.trajectory import added_use

SHAPER = Shaper.of(ShaperKind.EI, Mode(15.0, 0.03))
SPEED = PlatformSpeedLimit(MACHINE, 0.25)
SMOOTH = Masses.uniform(1.0, 0.2, 1.0)
ROUGH = Masses.uniform(0.5, 2.0, 0.5, payload=0.3, coulomb=2.0, viscous=5.0)


def forces(masses: Masses = SMOOTH, up: float = 40.0, down: float = 40.0) -> ForceLimits:
    return ForceLimits(SliderForces(MACHINE, masses), (up,) * 3, (down,) * 3)


@cache
def motions(limits: SliderLimits = LIMITS, count: int = 1) -> list[Trajectory]:
    """Return moves of both kinds, shaped ones, and paths, between random places."""
    rng = np.random.default_rng(3)
    found: list[Trajectory] = []
    for _ in range(count):
        start, end, other = rng.uniform(LOWER, UPPER, (3, 3)).tolist()
        found += [plan_move(WORKSPACE, limits, start, end, kind=kind) for kind in MotionKind]
        found.append(plan_move(WORKSPACE, limits, start, end, shaper=SHAPER))
        path = PlatformPath.start(start).line_to(end, tolerance=0.005).line_to(other)
        found.append(time_path(path, WORKSPACE, limits))
    return found


def sampled(motion: Trajectory, bound: AddedBound) -> float:
    """Return the largest part of a bound at many instants, by another way than the proof."""
    samples = motion.sample(np.linspace(0.0, motion.duration, 401)[1:-1])
    if isinstance(bound, PlatformSpeedLimit):
        rates = [
            MACHINE.forward_velocity(heights, velocities)[1]
            for heights, velocities in zip(samples.heights, samples.velocities)
        ]
        return float(np.linalg.norm(rates, axis=1).max() / bound.speed)
    assert isinstance(bound, ForceLimits)
    still = np.zeros_like(samples.heights)
    held = bound.forces.forces_batch(samples.heights, still, still)
    driven = bound.forces.forces_batch(*samples[1:]) - held
    up = driven / (np.array(bound.up) - held)
    return float(max(up.max(), (-driven / (np.array(bound.down) + held)).max()))


BOUNDS = pytest.mark.parametrize(
    "bound", [SPEED, forces(), forces(ROUGH, 60.0, 30.0)], ids=("speed", "forces", "friction")
)


@BOUNDS
def test_what_is_proved_is_no_less_than_samples_and_little_more(bound):
    # As fast as the bound lets it be, and slower: so it is kept, with more and less to spare.
    fast = SliderLimits.uniform(2.0, 60.0, 2000.0).with_added(bound)
    slow = SliderLimits.uniform(0.1, 2.0, 100.0)
    for motion in motions(fast) + motions(slow):
        proved, found = at_once(added_use(motion, bound)).part, sampled(motion, bound)
        assert found <= proved * (1.0 + 1e-9) <= (1.0 + 1e-7)
        assert proved < 1.1 * found + 0.02


@BOUNDS
def test_all_kinds_of_motion_keep_an_added_bound_and_use_it(bound):
    fast = SliderLimits.uniform(2.0, 60.0, 2000.0)
    for motion in motions(fast.with_added(bound)):
        assert 0.8 < sampled(motion, bound) <= 1.0 + 1e-6
        motion.check_limits(fast.with_added(bound))
    broken = [motion for motion in motions(fast) if sampled(motion, bound) > 1.001]
    assert len(broken) > 2
    for motion in broken:
        assert not motion.keeps_limits(fast.with_added(bound))
        with pytest.raises(AddedBoundError):
            motion.check_limits(fast.with_added(bound))
        # The limits of the sliders alone hold.
        motion.check_limits(fast)


@BOUNDS
def test_a_part_of_a_bound_allows_that_part(bound):
    half = bound.times(0.8).times(0.625)
    assert half == bound.times(0.5)
    assert bound.times(1.0) is bound
    fast = SliderLimits.uniform(2.0, 60.0, 2000.0)
    for motion in motions(fast.with_added(half)):
        assert 0.4 < sampled(motion, bound) <= 0.5 * (1.0 + 1e-6)
        for state in (motion.at(share * motion.duration) for share in (0.1, 0.3, 0.8)):
            assert half.part_at(state) == pytest.approx(2.0 * bound.part_at(state))
            assert half.part_at(state) <= 1.0 + 1e-6
            assert bound.part_at(state) == pytest.approx(AddedBound.part_at(bound, state))
            assert half.raised(state) == half
            # Where the motion uses more than a small part, as much of it is allowed.
            used, little = bound.part_at(state), bound.times(1e-3)
            assert little.raised(state) == bound.times(max(used, 1e-3))
            assert bound.raised(state) is bound


def cells_of_pieces(monkeypatch, computation) -> list[tuple[int, int]]:
    """Return in how many cells each piece makes a series, and in how many it asks a bound."""
    pieces, counts = [], [0, 0]

    def polynomial(coefficients, half):
        counts[0] += len(half)
        return series.polynomial(coefficients, half)

    def used(bound, position, half):
        counts[1] += len(half)
        return PlatformSpeedLimit.used(bound, position, half)

    with monkeypatch.context() as patch:
        patch.setattr(along_curve, "polynomial", polynomial)
        patch.setattr(cubic, "polynomial", polynomial)
        patch.setattr(CountedSpeed, "used", used)
        try:
            while True:
                counts[:] = 0, 0
                next(computation)
                pieces.append((counts[0], counts[1]))
        except StopIteration:
            pieces.append((counts[0], counts[1]))
    return pieces


class CountedSpeed(PlatformSpeedLimit):
    """A speed limit that can be counted."""


@pytest.mark.parametrize("kind", MotionKind)
def test_a_piece_makes_series_of_few_cells_or_asks_a_bound_in_them(kind, monkeypatch):
    bound = CountedSpeed(MACHINE, 0.25)
    slow = SliderLimits.uniform(0.02, 10.0, 200.0).with_added(bound)
    motion = plan_move(WORKSPACE, slow, (-0.1, 0.0, 0.3), (0.1, 0.0, 0.3), kind=kind)
    computations = [added_use(motion, bound)]
    if isinstance(motion, LinePlan):
        computations.append(bounds_along(motion.curve, motion.scaling, slow))
    for computation in computations:
        made, asked = zip(*cells_of_pieces(monkeypatch, computation))
        assert max(made) <= 64
        assert sum(made) == sum(asked) > 0
        assert not any(map(min, made, asked))
    # The last one of a line looks at more than one piece has.
    assert sum(made) > 64 or kind is MotionKind.SLIDER


def test_a_line_is_as_fast_as_the_platform_may_be():
    limits = SliderLimits.uniform(2.0, 60.0, 2000.0).with_added(SPEED)
    motion = plan_move(WORKSPACE, limits, (-0.1, 0.0, 0.3), (0.1, 0.0, 0.3), kind=MotionKind.LINEAR)
    assert 0.999 < sampled(motion, SPEED) <= 1.0 + 1e-6
    assert motion.duration < 0.2 / SPEED.speed + 0.05


def test_forces_make_a_path_soon_over():
    """Upwards the weight leaves less than downwards; one limit of accelerations knows neither."""
    bound = forces(Masses.uniform(1.0, 0.05, 1.0), 50.0, 50.0)
    ample = SliderLimits.uniform(3.0, 500.0, 5000.0).with_added(bound)
    path = PlatformPath.start((0.0, 0.0, 0.25)).line_to((0.0, 0.0, 0.35))
    motion = time_path(path, WORKSPACE, ample)
    # The mass of each slider on a vertical line, its weight, and the soonest motion without jerk.
    mass = 1.0 + (1.0 + 3.0 * 0.05) / 3.0
    up, down = 50.0 / mass - 9.80665, 50.0 / mass + 9.80665
    soonest = (2.0 * 0.1 * (1.0 / up + 1.0 / down)) ** 0.5
    assert soonest < motion.duration < soonest + 2.0 * (up + down) / 5000.0


def test_errors_tell_numbers_and_bounds():
    motion = plan_move(WORKSPACE, LIMITS, (-0.1, 0.0, 0.3), (0.1, 0.0, 0.3))
    with pytest.raises(AddedBoundError, match=r"speed of the platform would be 1\.\d+ m/s, its"):
        motion.check_limits(LIMITS.with_added(SPEED))
    with pytest.raises(AddedBoundError, match="part of the force limits beside the weight would"):
        motion.check_limits(LIMITS.with_added(forces(up=25.0)))
    with pytest.raises(OutOfBoundsError, match=r"platform_speed_limit"):
        PlatformSpeedLimit(MACHINE, 0.0)
    with pytest.raises(NotFiniteError, match=r"force_limit_up\[0\]"):
        forces(up=float("nan"))
    with pytest.raises(OutOfBoundsError, match=r"force_limit_down\[0\]"):
        forces(down=-1.0)


def test_a_limit_that_cannot_hold_the_weight_is_told():
    places = np.array((LOWER, UPPER))
    still = np.zeros((2, 3))
    needed = SliderForces(MACHINE, SMOOTH).forces_batch(MACHINE.inverse_batch(places), still, still)
    most = float(needed.max())
    forces(up=most * 1.001).check_holding(places)
    with pytest.raises(CannotHoldError, match=r"force_limit_up\[\d\] = .* cannot hold the weight"):
        forces(up=most * 0.999).check_holding(places)


def test_bounds_stay_when_limits_change():
    bounded = LIMITS.with_added(SPEED, forces())
    for changed in (
        bounded.times(0.5, 0.5, 0.5),
        bounded.with_velocity_scaled(0.1),
        bounded.with_table(2.0 * bounded.table),
    ):
        assert changed.added == bounded.added
    assert bounded.platform_speed == 0.25
    assert LIMITS.platform_speed == np.inf
    assert bounded == LIMITS.with_added(SPEED, forces())
    assert bounded != LIMITS.with_added(SPEED, forces(SMOOTH.with_payload(0.1)))
