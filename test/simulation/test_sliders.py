import math

import pytest
from motion_machine import MACHINE

from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.simulation import (
    DriveTime,
    PositionControl,
    Setpoint,
    SimulatedDrives,
    SimulatedOutputs,
    SimulatedSliders,
    SliderFaults,
)

LOWER, UPPER = (0.3, 0.3, 0.3), (0.9, 0.9, 0.9)
HOME = (0.6, 0.6, 0.6)


@pytest.fixture
def sliders():
    return SimulatedSliders(HOME, LOWER, UPPER)


def test_rest_without_a_command(sliders):
    sliders.step(0.002)
    assert sliders.measure() == (HOME, (0.0, 0.0, 0.0))


def test_without_lag_the_command_is_reached_in_one_step(sliders):
    sliders.command(Setpoint((0.601, 0.6, 0.598)))
    sliders.step(0.002)
    heights, velocities = sliders.measure()
    assert heights == pytest.approx((0.601, 0.6, 0.598))
    assert velocities == pytest.approx((0.5, 0.0, -1.0))


@pytest.mark.parametrize("dt", [0.001, 0.004])
def test_lag_is_exact_for_any_step(sliders, dt):
    sliders.lag = 0.02
    sliders.command(Setpoint((0.7, 0.6, 0.6)))
    for _ in range(round(0.04 / dt)):
        sliders.step(dt)
    assert sliders.measure()[0][0] == pytest.approx(0.7 - 0.1 * math.exp(-2.0))


def test_hard_stops(sliders):
    sliders.command(Setpoint((1.5, 0.0, 0.6)))
    sliders.step(0.002)
    assert sliders.measure()[0] == (0.9, 0.3, 0.6)


def test_encoder_resolution(sliders):
    sliders.encoder_resolution = 1e-4
    sliders.command(Setpoint((0.60004, 0.60006, 0.6)))
    sliders.step(0.002)
    assert sliders.measure()[0] == pytest.approx((0.6, 0.6001, 0.6), abs=1e-12)


def test_stuck_slider(sliders):
    sliders.faults = SliderFaults(stuck_sliders=(False, True, False))
    sliders.command(Setpoint((0.7, 0.7, 0.7)))
    sliders.step(0.002)
    heights, velocities = sliders.measure()
    assert heights == (0.7, 0.6, 0.7)
    assert velocities[1] == 0.0


def test_frozen_encoder_shows_what_it_showed(sliders):
    sliders.faults = SliderFaults(frozen_encoders=(True, False, False))
    sliders.command(Setpoint((0.7, 0.7, 0.7)))
    sliders.step(0.002)
    assert sliders.measure() == ((0.6, 0.7, 0.7), pytest.approx((0.0, 50.0, 50.0)))
    sliders.faults = SliderFaults()
    assert sliders.measure()[0] == (0.7, 0.7, 0.7)


def test_offset_is_a_jump_of_the_encoder_alone(sliders):
    sliders.faults = SliderFaults(encoder_offsets=(0.0, 0.0, 0.05))
    sliders.step(0.002)
    assert sliders.measure() == (pytest.approx((0.6, 0.6, 0.65)), (0.0, 0.0, 0.0))


def test_drop_outs(sliders):
    sliders.faults = SliderFaults(drop_out=0.25)
    lost = sum(sliders.measure() is None for _ in range(10_000))
    assert 2300 < lost < 2700
    sliders.faults = SliderFaults(drop_out=1.0)
    assert all(sliders.measure() is None for _ in range(100))


def test_encoders_show_what_they_look_at(sliders):
    sliders.encoder_resolution = 1e-4
    sliders.faults = SliderFaults(frozen_encoders=(True, False, False))
    seen = ((0.7, 0.70004, 0.8), (0.1, 0.2, 0.3))
    assert sliders.measure(seen) == (pytest.approx((0.6, 0.7, 0.8)), (0.0, 0.2, 0.3))


HERE, OTHER = Setpoint(HOME), Setpoint((0.61, 0.6, 0.6))
PERIOD = 0.002


def test_drives_go_to_the_newest_setpoint_in_each_cycle():
    time = DriveTime()
    assert time.steps(PERIOD) == [(None, PERIOD)]
    time.command(HERE)
    time.command(OTHER)
    assert time.steps(PERIOD) == [(OTHER, PERIOD)]
    assert time.steps(PERIOD) == [(None, PERIOD)]


def test_drives_take_each_setpoint_for_its_period():
    time = DriveTime(0.004)
    time.command(HERE)
    time.command(OTHER)
    assert time.steps(PERIOD) == [(HERE, 0.004), (OTHER, 0.004)]
    late = [time.steps(PERIOD) for _ in range(260)]
    # A late one is waited for, but not for ever.
    assert late[:249] == [[]] * 249
    assert late[-1] == [(None, PERIOD)]
    time.command(HERE)
    assert time.steps(PERIOD) == [(HERE, 0.004)]
    assert time.steps(PERIOD) == []


def test_drives_with_masses_hold_their_sliders_and_stop_at_the_ends(sliders):
    forces = SliderForces(MACHINE, Masses.uniform(1.0, 0.1, 1.0))
    control = PositionControl((6000.0,) * 3, (130.0,) * 3)
    sliders.drives = SimulatedDrives(forces, control, HOME)
    weight = sliders.exerted
    for _ in range(100):
        sliders.command(Setpoint(HOME, forces=weight))
        sliders.step(PERIOD)
    assert sliders.measure()[0] == pytest.approx(HOME, abs=1e-9)
    sliders.faults = SliderFaults(stuck_sliders=(False, True, False))
    sliders.command(Setpoint((0.62, 0.62, 0.62), forces=weight))
    for _ in range(500):
        sliders.step(PERIOD)
    heights, velocities = sliders.measure()
    assert heights[1] == pytest.approx(0.6, abs=1e-9)
    assert heights[0] == pytest.approx(0.62, abs=5e-3)
    assert velocities == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    sliders.faults = SliderFaults()
    sliders.command(Setpoint((1.5, 1.5, 1.5), forces=(200.0,) * 3))
    for _ in range(500):
        sliders.step(PERIOD)
    assert sliders.measure() == (UPPER, (0.0, 0.0, 0.0))


def test_outputs_are_off_while_there_is_no_sign_of_life_and_the_others_keep_their_values():
    outputs = SimulatedOutputs(("spindle",), patience=1.0)
    outputs.set("spindle", 0, 9.0)
    outputs.set("fan", 0, 1.0)
    # Before the first sign nothing is switched on that would have to be off.
    assert sorted(outputs.look(5.0)) == [("fan", 0, 1.0), ("spindle", 0, 0.0)]
    outputs.hear(6.0)
    outputs.set("spindle", 0, 9.0)
    assert outputs.look(7.0) == [("spindle", 0, 9.0)]
    assert outputs.look(7.0) == []
    assert outputs.look(7.1) == [("spindle", 0, 0.0)]
    # What comes back finds it off, until it is switched on again.
    outputs.hear(8.0)
    assert outputs.look(8.1) == []


def test_drives_with_masses_exert_the_forces_of_their_setpoint(sliders):
    forces = SliderForces(MACHINE, Masses.uniform(1.0, 0.1, 1.0))
    sliders.drives = SimulatedDrives(forces, PositionControl((6000.0,) * 3, (130.0,) * 3), HOME)
    weight = sliders.exerted
    sliders.command(Setpoint(HOME, forces=tuple(each + 10.0 for each in weight)))
    sliders.step(PERIOD)
    assert all(now > before + 4.0 for now, before in zip(sliders.exerted, weight))
