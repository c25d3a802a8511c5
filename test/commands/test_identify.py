"""The command identify: from verified moves, driven by simulated drives, to masses and friction."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tri_glide_kinematics.commands import identify
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion import MotionKind, SliderLimits
from tri_glide_kinematics.programs import load_drive, time_steps
from tri_glide_kinematics.settings import (
    IK_NODE,
    file_values,
    forces_of,
    limits_of,
    machine_of,
    workspace_limits_of,
)
from tri_glide_kinematics.simulation import PositionControl, Setpoint, SimulatedDrives
from tri_glide_kinematics.workspace import Workspace

PERIOD = 1e-3
# Of the simulated drives [s].
LONGEST_STEP = 5e-4
DURATION = 2.0
MASSES = replace(Masses.uniform(1.0, 0.5, 0.6, coulomb=4.0, viscous=9.0), carriages=(1.0, 1.2, 0.9))
CONTROL = PositionControl((40000.0,) * 3, (500.0,) * 3)
OFFSETS = (0.02, -0.01, 0.0)
PARAMETERS = """/ik_node:
  ros__parameters:
    velocity_limits: [1.5, 1.5, 1.5]
    acceleration_limits: [20.0, 20.0, 20.0]
    jerk_limits: [400.0, 400.0, 400.0]
    height_offsets: [0.02, -0.01, 0.0]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with parameters, moves, and the table of a machine that has driven them."""
    folder = tmp_path_factory.mktemp("identify")
    parameters, moves = folder / "machine.yaml", folder / "new" / "moves.yaml"
    parameters.write_text(PARAMETERS)
    options = ["--parameters", str(parameters), "--duration", str(DURATION)]
    assert identify.main(["--excite", str(moves), *options]) == 0
    values = file_values(str(parameters), "/ik_node", IK_NODE)
    machine = machine_of(values)
    workspace = Workspace(machine, workspace_limits_of(values))
    kind = MotionKind(values["motion"])
    motion = time_steps(load_drive(moves), workspace, limits_of(values), kind=kind).trajectory
    assert motion.duration >= DURATION
    motion.check_limits(SliderLimits.uniform(1.5, 20.0, 400.0))
    measured = driven(SliderForces(machine, MASSES), motion)
    np.save(folder / "measured.npy", measured)
    write_table(folder / "run.csv", measured)
    return folder


def driven(forces, motion):
    """Return times, heights and efforts of drives that know no masses. Shape (n, 7)."""
    times = np.arange(0.0, motion.duration, PERIOD)
    _, heights, velocities, _ = motion.sample(times)
    place, rate = tuple(heights[0]), (0.0, 0.0, 0.0)
    drives = SimulatedDrives(forces, CONTROL, place)
    rows = []
    for time, wanted, speed in zip(times.tolist(), heights.tolist(), velocities.tolist()):
        place, rate = drives.step(place, rate, Setpoint(tuple(wanted), tuple(speed)), PERIOD)
        rows.append((time, *place, *drives.exerted))
    measured = np.array(rows)
    # The drives tell the force in the middle of their last step.
    middles = times - 0.5 * LONGEST_STEP
    for column in (4, 5, 6):
        measured[:, column] = np.interp(times, middles, measured[:, column])
    return measured


def write_table(file: Path, measured, noise=0.02, resolution=1e-6):
    """Write what encoders of this resolution [m] and drives with this part of noise tell."""
    heights, efforts = measured[:, 1:4] - OFFSETS, measured[:, 4:]
    rng = np.random.default_rng(0)
    efforts = efforts + noise * np.abs(efforts).max() * rng.normal(size=efforts.shape)
    rows = np.column_stack((measured[:, 0], resolution * np.round(heights / resolution), efforts))
    kinds = (("height", "m"), ("effort", "N"))
    head = ["time [s]", *(f"{name}_{i} [{unit}]" for name, unit in kinds for i in (1, 2, 3))]
    lines = [", ".join(head), *(", ".join(f"{each:.9f}" for each in row) for row in rows)]
    file.write_text("\n".join([*lines, ""]))


def options_of(folder):
    return ["--parameters", str(folder / "machine.yaml")]


def test_masses_and_friction_are_found_within_two_percent(folder, capsys):
    written = folder / "masses.yaml"
    arguments = [str(folder / "run.csv"), *options_of(folder), "--write", str(written)]
    assert identify.main(arguments) == 0
    told = capsys.readouterr().out
    assert "carriage 2 [kg]" in told
    assert "given: counterweight 1 = 0 kg" in told
    assert "may be zero" not in told
    values = file_values(str(written), "/ik_node", IK_NODE)
    found = forces_of(values, machine_of(values)).masses
    for name in ("carriages", "platform", "coulomb", "viscous"):
        assert getattr(found, name) == pytest.approx(getattr(MASSES, name), rel=0.02), name
    assert [arm.mass for arm in found.arms] == pytest.approx([0.5] * 3, rel=0.08)
    # Nothing of somebody else is overwritten.
    written.write_text("mine")
    assert identify.main(arguments) == 1
    assert "its first line is not" in capsys.readouterr().err


def estimates(told):
    """Return value and deviation by name."""
    rows = [line.split("[") for line in told.splitlines() if "]" in line]
    return {name.strip(): tuple(map(float, rest.split("]")[1].split()[:2])) for name, rest in rows}


def test_what_was_weighed_makes_the_rest_more_exact(folder, capsys):
    table = str(folder / "run.csv")
    assert identify.main([table, *options_of(folder)]) == 0
    before = estimates(capsys.readouterr().out)
    weighed = [word for i in (1, 2, 3) for word in ("--known", f"arm {i}=0.5")]
    assert identify.main([table, *options_of(folder), *weighed]) == 0
    told = capsys.readouterr().out
    after = estimates(told)
    assert "arm 1 = 0.5 kg" in told and "arm 1" not in after
    assert after["carriage 1"][1] < 0.8 * before["carriage 1"][1]
    for name, true in (("carriage 1", 1.0), ("platform", 0.6), ("dry friction 3", 4.0)):
        value, deviation = after[name]
        assert abs(value - true) < 4.0 * deviation + 0.003 * true


def test_arms_of_any_kind_are_told_as_sums(folder, capsys):
    assert identify.main([str(folder / "run.csv"), *options_of(folder), "--any-arms"]) == 0
    told = capsys.readouterr().out
    assert "only their sums are known: carriage 1 + arm 1 - inertia of arm 1; " in told


def test_rows_that_are_missing_and_late_stamps_do_little(folder, capsys):
    measured = np.load(folder / "measured.npy")
    kept = np.delete(measured, [*range(800, 850), *range(1200, 2100, 63)], axis=0)
    rng = np.random.default_rng(1)
    late = kept[:, 0] + rng.exponential(2e-5, len(kept))
    # Where the slider is at that time.
    moved = [np.interp(late, measured[:, 0], each) for each in measured[:, 1:].T]
    write_table(folder / "holes.csv", np.column_stack((late, *moved)))
    assert identify.main([str(folder / "holes.csv"), *options_of(folder)]) == 0
    found = estimates(capsys.readouterr().out)
    assert found["carriage 2"][0] == pytest.approx(1.2, rel=0.02)
    assert found["platform"][0] == pytest.approx(0.6, rel=0.02)


def test_what_is_known_has_a_name(folder, capsys):
    table = folder / "run.csv"
    assert identify.main([str(table), *options_of(folder), "--known", "payload=1"]) == 1
    assert "known = 'payload' must be carriage 1 or" in capsys.readouterr().err
    # A table has no topics, so that any name will do.
    assert identify.main([str(table), *options_of(folder), "--topic", "x"]) == 0


def test_a_recording_that_tells_nothing_is_refused(folder, capsys):
    lines = (folder / "run.csv").read_text().splitlines()
    short, bare = folder / "short.csv", folder / "bare.csv"
    short.write_text("\n".join([*lines[:30], ""]))
    bare.write_text("\n".join([*(",".join(line.split(",")[:4]) for line in lines[:200]), ""]))
    for file, reason in ((short, "0 efforts of sliders in motion"), (bare, "has no efforts")):
        assert identify.main([str(file), *options_of(folder)]) == 1
        assert reason in capsys.readouterr().err
