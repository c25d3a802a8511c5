"""Settings of Klipper, Marlin and RepRapFirmware: their own formulas, and there and back."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from strategies import random_geometry

from testing.wrong_machines import NOMINAL, WrongMachine
from tri_glide_kinematics.calibration.firmwares import (
    KlipperDelta,
    MarlinDelta,
    RepRapFirmwareDelta,
)
from tri_glide_kinematics.calibration.fit import MachineParameters
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry

FIRMWARES = (KlipperDelta, MarlinDelta, RepRapFirmwareDelta)
END_STOPS = (0.85, 0.86, 0.87)


def with_circle(geometry):
    """Return the geometry if its arms reach the centre of the circle through its anchors."""
    machine = MachineParameters(geometry)
    with np.errstate(invalid="ignore"):
        heights = KlipperDelta.of(machine).settings.position_endstops
    return machine if np.isfinite(heights).all() else None


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_there_and_back_is_the_same_machine_but_for_shift_and_names(firmware):
    rng = np.random.default_rng(4)
    done = 0
    while done < 50:
        machine = with_circle(random_geometry(rng, symmetric=bool(done % 2)))
        if machine is None:
            continue
        done += 1
        offsets = tuple(rng.uniform(-0.01, 0.01, 3))
        machine = MachineParameters(machine.geometry, offsets)
        converted = firmware.of(machine, END_STOPS)
        order = list(converted.towers)
        stops = tuple(END_STOPS[i] for i in order)
        back = converted.settings.machine(stops)
        moved = np.array(machine.geometry.anchors)[order] + converted.shift
        np.testing.assert_allclose(back.geometry.anchors, moved, atol=1e-12)
        arms = np.array(machine.geometry.arm_lengths)[order]
        np.testing.assert_allclose(back.geometry.arm_lengths, arms, atol=1e-12)
        np.testing.assert_allclose(back.height_offsets, np.array(offsets)[order], atol=1e-12)


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_homing_puts_the_nozzle_where_the_settings_say(firmware):
    machine = WrongMachine.random(np.random.default_rng(2)).parameters
    converted = firmware.of(machine, END_STOPS)
    settings = converted.settings
    order = list(converted.towers)
    ends = (np.array(END_STOPS) + machine.height_offsets)[order]
    back = TriGlide(settings.machine(tuple(np.array(END_STOPS)[order])).geometry)
    # Where each firmware believes to be after homing, all carriages at their end stops or moved
    # from them as it says: in the middle, at its height.
    if isinstance(settings, KlipperDelta):
        expected = np.array(settings.position_endstops) / 1000.0
        for i in range(3):
            heights = back.inverse((0.0, 0.0, expected[i]))
            assert heights[i] == pytest.approx(ends[i], abs=1e-12)
        return
    if isinstance(settings, MarlinDelta):
        height, moved = settings.height, ends + np.array(settings.endstop_adj) / 1000.0
        assert max(settings.endstop_adj) == 0.0
    else:
        height, moved = settings.homed_height, ends - np.array(settings.endstop_adjustments) / 1e3
        assert sum(settings.endstop_adjustments) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(back.forward(moved), (0.0, 0.0, height / 1000.0), atol=1e-12)


def test_klipper_has_its_own_angles_for_its_own_machine():
    radius, arm = 0.1, 0.27
    anchors = [
        (radius * math.cos(math.radians(a)), radius * math.sin(math.radians(a)))
        for a in (210.0, 330.0, 90.0)
    ]
    machine = MachineParameters(TriGlideGeometry(anchors, (arm,) * 3))
    converted = KlipperDelta.of(machine, (0.5, 0.5, 0.5))
    assert converted.towers == (0, 1, 2)
    assert converted.settings.delta_radius == pytest.approx(100.0)
    assert converted.settings.angles == pytest.approx((210.0, 330.0, 90.0))
    nozzle = 500.0 - math.sqrt(270.0**2 - 100.0**2)
    assert converted.settings.position_endstops == pytest.approx((nozzle,) * 3)


def test_reprapfirmware_places_its_towers_by_its_own_formulas():
    settings = RepRapFirmwareDelta(
        (300.0, 301.0, 302.0), 120.0, 250.0, (0.5, -0.3, 0.2), (0.1, 0, 0)
    )
    (ax, ay), (bx, by), (cx, cy) = 1000.0 * np.array(settings.machine().geometry.anchors)
    a, b, c = np.radians([30.5, 30.3, 0.2])
    assert (ax, ay) == pytest.approx((-120.0 * math.cos(a), -120.0 * math.sin(a)))
    assert (bx, by) == pytest.approx((120.0 * math.cos(b), -120.0 * math.sin(b)))
    assert (cx, cy) == pytest.approx((-120.0 * math.sin(c), 120.0 * math.cos(c)))


def test_settings_are_written_as_the_firmwares_read_them():
    klipper = KlipperDelta.of(NOMINAL, END_STOPS).settings
    assert str(klipper).splitlines()[:4] == [
        "[printer]",
        "delta_radius: 200",
        "[stepper_a]",
        "angle: 210",
    ]
    reprap = str(RepRapFirmwareDelta.of(NOMINAL, END_STOPS).settings)
    assert reprap.startswith("M665 L400:400:400 R200 H") and "\nM666 X" in reprap
    marlin = str(MarlinDelta.of(NOMINAL, END_STOPS).settings)
    assert "#define DELTA_DIAGONAL_ROD 400" in marlin
    assert "#define DELTA_TOWER_ANGLE_TRIM { 0, 0, 0 }" in marlin


@pytest.mark.parametrize("kind", FIRMWARES)
def test_numbers_that_are_missing_are_named(kind):
    settings = kind.of(NOMINAL, END_STOPS).settings
    for each in fields(settings):
        wrong = (1.0, 2.0) if isinstance(getattr(settings, each.name), tuple) else None
        with pytest.raises(KinematicsError, match=each.name):
            replace(settings, **{each.name: wrong})
