"""The geometry of Klipper, Marlin and RepRapFirmware: their own formulas, and there and back."""

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from strategies import random_geometry

from testing.wrong_machines import NOMINAL, WrongMachine
from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares import Firmware
from tri_glide_kinematics.firmwares.parameters import lines_of, texts_of
from tri_glide_kinematics.firmwares.reading import settings_of
from tri_glide_kinematics.firmwares.towers import towers_of
from tri_glide_kinematics.tri_glide import TriGlide

END_STOPS = (1.85, 1.86, 1.87)
each_firmware = pytest.mark.parametrize("firmware", Firmware)


def written_and_read(firmware, machine):
    """Return a machine as lines of a firmware say it, and which towers its arms are."""
    texts = texts_of(firmware, machine, END_STOPS, 0.0)
    lines = "\n".join((*lines_of(firmware, texts.texts), "#define DELTA"))
    return settings_of(firmware, [(Path(), lines)]), list(texts.order)


def with_circle(geometry):
    """Return the geometry if its arms reach the centre of the circle through its anchors."""
    machine = MachineParameters(geometry)
    try:
        towers_of(machine, END_STOPS)
    except KinematicsError:
        return None
    return machine


@each_firmware
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
        shift = towers_of(machine, END_STOPS).shift
        back, order = written_and_read(firmware, machine)
        moved = np.array(machine.geometry.anchors)[order] + shift
        np.testing.assert_allclose(back.machine.geometry.anchors, moved, atol=1e-12)
        arms = np.array(machine.geometry.arm_lengths)[order]
        np.testing.assert_allclose(back.machine.geometry.arm_lengths, arms, atol=1e-12)
        ends = np.add(END_STOPS, offsets)[order]
        np.testing.assert_allclose(back.end_stops, ends, atol=1e-12)


@each_firmware
def test_homing_puts_the_nozzle_where_the_settings_say(firmware):
    machine = WrongMachine.random(np.random.default_rng(2)).parameters
    settings, order = written_and_read(firmware, machine)
    ends = np.add(END_STOPS, machine.height_offsets)[order]
    robot = TriGlide(settings.machine.geometry)
    # Where each firmware believes to be after homing, all carriages at their end stops or moved
    # from them as it says: in the middle, at its height.
    if firmware is Firmware.KLIPPER:
        for i, tower in enumerate("abc"):
            (height,) = settings.numbers(f"stepper_{tower}.position_endstop")
            assert robot.inverse((0.0, 0.0, height / 1e3))[i] == pytest.approx(ends[i], abs=1e-12)
        return
    if firmware is Firmware.MARLIN:
        (height,), moves = settings.numbers("DELTA_HEIGHT"), settings.numbers("DELTA_ENDSTOP_ADJ")
        moved = ends + np.array(moves) / 1e3
        assert max(moves) == 0.0
    else:
        (height,) = settings.numbers("M665 H")
        moves = [settings.numbers(f"M666 {axis}")[0] for axis in "XYZ"]
        moved = ends - np.array(moves) / 1e3
        assert sum(moves) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(robot.forward(moved), (0.0, 0.0, height / 1e3), atol=1e-12)


def test_settings_are_written_as_the_firmwares_read_them():
    klipper, marlin, reprap = (
        "\n".join(lines_of(firmware, texts_of(firmware, NOMINAL, END_STOPS, 0.0).texts))
        for firmware in Firmware
    )
    assert klipper.startswith("[printer]\ndelta_radius: 200\n[stepper_a]\nangle: 210\n")
    assert reprap.startswith("M665 L400:400:400 R200 H") and "\nM666 X" in reprap
    assert "#define DELTA_DIAGONAL_ROD 400" in marlin
    assert "#define DELTA_TOWER_ANGLE_TRIM { 0, 0, 0 }" in marlin


def test_numbers_that_are_missing_are_named():
    towers = towers_of(NOMINAL, END_STOPS).towers
    for each in fields(towers):
        with pytest.raises(KinematicsError, match=each.name):
            replace(towers, **{each.name: (1.0, math.nan, 1.0)})
