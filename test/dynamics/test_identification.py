import re
from dataclasses import replace

import numpy as np
import pytest
from strategies import random_geometry, random_motion

from testing.masses import random_masses
from tri_glide_kinematics.dynamics import (
    ANY_ARMS,
    NO_COUNTERWEIGHTS,
    UNIFORM_ARMS,
    Arm,
    Estimate,
    Masses,
    NotIdentifiedError,
    SliderForces,
    TooFewSamplesError,
    identify,
    regressor,
)
from tri_glide_kinematics.errors import NotAChoiceError
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide

MACHINE = TriGlide(DEFAULT_GEOMETRY)
MASSES = Masses.uniform(1.0, 0.3, 0.6, coulomb=4.0, viscous=9.0)


def parameters_of(machine, masses, uniform_arms=True):
    ends = [
        arm.end_masses(length) for arm, length in zip(masses.arms, machine.geometry.arm_lengths)
    ]
    arms = [arm.mass for arm in masses.arms]
    if not uniform_arms:
        arms += [arm.mass * arm.centre for arm in masses.arms]
        arms += [far for _, _, far in ends]
    whole = (*masses.carriages, *masses.counterweights, masses.platform + masses.payload)
    return np.array((*whole, *arms, *masses.coulomb, *masses.viscous))


@pytest.mark.parametrize("uniform_arms", [True, False], ids=["uniform", "any"])
def test_the_regressor_times_the_parameters_gives_the_forces(uniform_arms):
    rng = np.random.default_rng(4)
    for _ in range(20):
        machine = TriGlide(random_geometry(rng, symmetric=False))
        masses = random_masses(rng)
        if uniform_arms:
            masses = replace(masses, arms=tuple(Arm(arm.mass) for arm in masses.arms))
        motion = random_motion(machine, rng, 5)
        matrices = regressor(machine, *motion, gravity=masses.gravity, uniform_arms=uniform_arms)
        found = matrices @ parameters_of(machine, masses, uniform_arms)
        expected = SliderForces(machine, masses).forces_batch(*motion)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_efforts_without_noise_give_masses_and_friction_exactly():
    motion = random_motion(MACHINE, np.random.default_rng(1), 60)
    masses = Masses(
        (1.0, 1.2, 0.9),
        (Arm(0.3), Arm(0.25), Arm(0.35)),
        0.6,
        0.2,
        counterweights=(0.4, 0.5, 0.6),
        coulomb=(4.0, 5.0, 6.0),
        viscous=(9.0, 8.0, 7.0),
    )
    efforts = SliderForces(MACHINE, masses).forces_batch(*motion)
    found = identify(MACHINE, *motion, efforts, known={})
    assert [each.name for each in found.estimates] == list(UNIFORM_ARMS)
    values = np.array([each.value for each in found.estimates])
    assert values == pytest.approx(parameters_of(MACHINE, masses), rel=1e-8)
    back = found.masses()
    assert back.platform == pytest.approx(0.8)
    assert SliderForces(MACHINE, back).forces_batch(*motion) == pytest.approx(efforts)


def test_of_arms_of_any_kind_only_sums_are_known():
    motion = random_motion(MACHINE, np.random.default_rng(2), 60)
    arms = (Arm(0.3, 0.4, 0.005), Arm(0.25, 0.6, 0.004), Arm(0.35))
    masses = replace(MASSES, arms=arms)
    efforts = SliderForces(MACHINE, masses).forces_batch(*motion)
    found = identify(MACHINE, *motion, efforts, uniform_arms=False)
    values = dict(zip(ANY_ARMS, parameters_of(MACHINE, masses, uniform_arms=False)))
    assert found.sums == (
        *(f"carriage {i} + arm {i} - inertia of arm {i}" for i in (1, 2, 3)),
        "platform + inertia of arm 1 + inertia of arm 2 + inertia of arm 3",
        *(f"moment of arm {i} - inertia of arm {i}" for i in (1, 2, 3)),
    )
    for each in found.estimates:
        true = sum(count * values[name] for name, count in each.parts.items())
        assert each.value == pytest.approx(true, rel=1e-7)
    with pytest.raises(NotIdentifiedError, match=re.escape("known are the sums carriage 1 + arm")):
        found.masses()
    # With the arms weighed and balanced, all else is known.
    weighed = {name: value for name, value in values.items() if "arm" in name}
    found = identify(
        MACHINE, *motion, efforts, uniform_arms=False, known={**NO_COUNTERWEIGHTS, **weighed}
    )
    assert found.sums == ()
    assert found.values == pytest.approx(values, rel=1e-7, abs=1e-9)


def test_a_slider_that_never_moves_tells_nothing_of_its_friction():
    rng = np.random.default_rng(3)
    heights, velocities, accelerations = random_motion(MACHINE, rng, 60)
    velocities[:, 1] = 0.0
    efforts = SliderForces(MACHINE, MASSES).forces_batch(heights, velocities, accelerations)
    found = identify(MACHINE, heights, velocities, accelerations, efforts)
    # All efforts of a slider at rest are left out, so its carriage is not known either.
    assert found.silent == ("carriage 2", "dry friction 2", "viscous friction 2")
    with pytest.raises(NotIdentifiedError, match="not known alone: carriage 2, dry friction 2"):
        found.masses()


def test_intervals_hold_the_true_values():
    """95 % of them, by 40 recordings with noise of their own."""
    rng = np.random.default_rng(6)
    motion = random_motion(MACHINE, rng, 400)
    efforts = SliderForces(MACHINE, MASSES).forces_batch(*motion)
    true = parameters_of(MACHINE, MASSES)[[name not in NO_COUNTERWEIGHTS for name in UNIFORM_ARMS]]
    sizes = np.array((1.0, 2.0, 4.0)) * 0.01 * np.abs(efforts).max()
    inside = []
    for _ in range(40):
        noisy = efforts + sizes * rng.normal(size=efforts.shape)
        found = identify(MACHINE, *motion, noisy)
        assert found.noise == pytest.approx(sizes, rel=0.2)
        values, deviations = np.array([(each.value, each.deviation) for each in found.estimates]).T
        inside.append(np.abs(values - true) <= 1.96 * deviations)
    assert 0.91 < np.mean(inside) < 0.985


def test_what_cannot_be_identified_is_refused():
    motion = random_motion(MACHINE, np.random.default_rng(5), 4)
    efforts = SliderForces(MACHINE, MASSES).forces_batch(*motion)
    with pytest.raises(TooFewSamplesError, match="12 efforts of sliders in motion are too few"):
        identify(MACHINE, *motion, efforts)
    with pytest.raises(NotAChoiceError, match="known = 'payload' must be carriage 1 or"):
        identify(MACHINE, *motion, efforts, known={"payload": 1.0})


def test_sums_are_told_in_words():
    estimate = Estimate({"carriage 1": 1.0, "arm 1": 0.5, "arm 2": -2.0}, 1.0, 0.1)
    assert estimate.name == "carriage 1 + 0.5 arm 1 - 2 arm 2"
