"""The whole motion of a file, from one call."""

from pathlib import Path

import numpy as np
import pytest
from motion_machine import DT, LIMITS, MACHINE, SHAPER, WORKSPACE, within

from tri_glide_kinematics.motion import MotionKind, plan_move
from tri_glide_kinematics.motion.path import PathPlaceError
from tri_glide_kinematics.programs import (
    NoMotionError,
    ProgramError,
    check_program,
    load_drive,
    load_program,
    load_settings,
    read_program,
    time_steps,
)

CONFIG = Path(__file__).parents[2] / "config"
SETTINGS = load_settings(CONFIG / "program_settings.yaml")


def sampled(timed):
    count = int(timed.trajectory.duration / DT) + 10
    return timed.trajectory.sample(DT * np.arange(count))


def drive_file(tmp_path, text):
    file = tmp_path / "drive.yaml"
    file.write_text(f"steps:\n{text}")
    return load_drive(file)


def test_a_program_is_as_long_as_its_check_says_and_rests_where_it_dwells():
    program = load_program(CONFIG / "program_example.gcode", SETTINGS)
    timed = time_steps(program, WORKSPACE, LIMITS)
    told = check_program(program, WORKSPACE, LIMITS)
    assert timed.trajectory.duration == pytest.approx(told.duration, rel=1e-2)
    assert timed.begins[-1] == pytest.approx(timed.trajectory.duration, abs=1e-9)
    assert timed.steps == program.steps
    (dwell,) = (index for index, step in enumerate(timed.steps) if step.rest)
    begin, end = timed.begins[dwell : dwell + 2]
    assert end - begin == pytest.approx(timed.steps[dwell].duration)
    rest = timed.trajectory.sample(np.linspace(begin, end, 20))
    assert not rest.velocities.any()
    assert np.ptp(rest.heights, axis=0).max() < 1e-12
    assert within(sampled(timed).heights)


@pytest.mark.parametrize("kind", MotionKind)
@pytest.mark.parametrize("shaper", [None, SHAPER])
def test_a_drive_file_is_moves_paths_and_waits(kind, shaper):
    drive = load_drive(CONFIG / "drive_example.yaml")
    timed = time_steps(drive, WORKSPACE, LIMITS, kind=kind, shaper=shaper)
    assert within(sampled(timed).heights)
    (wait,) = (index for index, step in enumerate(timed.steps) if step.rest)
    durations = np.diff(timed.begins)
    assert durations[wait] == pytest.approx(0.5)
    # It begins where its first move ends.
    assert durations[0] == 0.0
    first = MACHINE.forward(timed.trajectory.at(0.0).heights)
    assert first == pytest.approx(drive.steps[0].position, abs=1e-12)
    last = drive.steps[-1].position
    end = MACHINE.forward(timed.trajectory.at(timed.trajectory.duration).heights)
    assert end == pytest.approx(last, abs=1e-9)
    before = MACHINE.forward(timed.trajectory.at(timed.begins[-2]).heights)
    move = plan_move(WORKSPACE, LIMITS, before, last, kind=kind, shaper=shaper)
    assert durations[-1] == pytest.approx(move.duration, abs=1e-6)


def test_a_move_with_a_speed_is_no_faster(tmp_path):
    drive = drive_file(
        tmp_path, "- move: {to: [0, 0, 0.2]}\n- move: {to: [0.05, 0, 0.25], speed: 0.05}\n"
    )
    samples = sampled(time_steps(drive, WORKSPACE, LIMITS))
    places = MACHINE.forward_batch(samples.heights)
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / DT
    assert 0.0499 < speeds.max() < 0.05 * (1.0 + 1e-6)


def test_a_rest_before_all_motion_counts():
    program = read_program("G4 P1\nG1 X10 F600\nM2\n", SETTINGS)
    timed = time_steps(program, WORKSPACE, LIMITS)
    assert timed.begins[1] == 1.0
    still = timed.trajectory.sample(np.linspace(0.0, 1.0, 9))
    assert np.ptp(still.heights, axis=0).max() < 1e-12
    assert timed.trajectory.duration == pytest.approx(timed.begins[-1])
    assert within(sampled(timed).heights)


def test_what_cannot_be_driven_is_told(tmp_path):
    with pytest.raises(NoMotionError, match=r"^part\.nc: nothing in it moves"):
        time_steps(read_program("M3 S9\nG4 P1\nM2\n", SETTINGS, "part.nc"), WORKSPACE, LIMITS)
    with pytest.raises(NoMotionError, match="put a move before it"):
        drive = drive_file(tmp_path, "- path: {segments: [{line: {to: [0, 0, 0.2]}}]}\n")
        time_steps(drive, WORKSPACE, LIMITS)
    program = read_program("G1 X10 F600\nX1000\nM2\n", SETTINGS)
    with pytest.raises(ProgramError, match="line 2") as told:
        time_steps(program, WORKSPACE, LIMITS)
    assert told.value.line == 2
    drive = drive_file(
        tmp_path, "- move: {to: [0, 0, 0.2]}\n- path: {segments: [{line: {to: [0, 0, 2.0]}}]}\n"
    )
    with pytest.raises(PathPlaceError):
        time_steps(drive, WORKSPACE, LIMITS)
