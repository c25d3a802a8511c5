"""The geometry of Klipper, Marlin and RepRapFirmware: their own formulas, and there and back."""

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from strategies import random_geometry

from testing.wrong_machines import NOMINAL
from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares import Firmware
from tri_glide_kinematics.firmwares.parameters import lines_of, texts_of
from tri_glide_kinematics.firmwares.reading import settings_of
from tri_glide_kinematics.firmwares.towers import towers_of

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


def test_numbers_that_are_missing_are_named():
    towers = towers_of(NOMINAL, END_STOPS).towers
    for each in fields(towers):
        with pytest.raises(KinematicsError, match=each.name):
            replace(towers, **{each.name: (1.0, math.nan, 1.0)})
