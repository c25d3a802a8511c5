"""The proof of a whole program, and the time that it tells."""

import numpy as np
import pytest
from motion_machine import DT, LIMITS, MACHINE, WORKSPACE, engine, place, run_to_rest

from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import (
    ForceLimits,
    MotionPhase,
    PlatformSpeedLimit,
    SliderLimits,
    time_path,
)
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.programs import (
    ProgramError,
    ProgramSettings,
    check_program,
    read_program,
)

HOME = (0.0, 0.0, 0.3)
SETTINGS = ProgramSettings(start=HOME, home=HOME)


MASSES = Masses.uniform(1.0, 0.05, 1.0, coulomb=2.0, viscous=5.0)
FORCES = ForceLimits(SliderForces(MACHINE, MASSES), (22.0,) * 3, (20.0,) * 3)


def checked(text, **settings):
    program = read_program(text, ProgramSettings(start=HOME, home=HOME, **settings))
    return check_program(program, WORKSPACE, LIMITS)


def driven(program, limits=LIMITS):
    """Drive a program in an engine; return how long it takes, and its way [m]."""
    moving = engine(limits=limits, heights=MACHINE.inverse(HOME))
    duration = length = 0.0
    for step in program.steps:
        duration += step.rest
        for run in step.runs:
            moving.follow(at_once(run.segments.path_from(run.start)))
            heights = run_to_rest(moving)
            duration += DT * (len(heights) - 1)
            places = np.array([MACHINE.forward(row) for row in heights])
            length += float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
    assert moving.phase is MotionPhase.IDLE
    return duration, length, place(moving)


SPIRAL = "".join(
    f"G1 X{20 * np.cos(0.05 * n):.4f} Y{20 * np.sin(0.05 * n):.4f} Z{300 + 0.02 * n:.4f} F6000\n"
    for n in range(150)
)
PROGRAMS = {
    "lines": "G0 X30\nG1 Y30 F6000\nX0\nY0\nM2\n",
    "slow": "G1 X10 F600\nG4 P0.5\nX0\nM2\n",
    "exact": "G61\nG0 X30\nG1 Y30 F6000\nX0\nY0\nM2\n",
    "arcs": "G64 P0.1\nG1 X20 F6000\nG3 X-20 R20\nG2 X20 I20 Z310\nG0 X0 Y0\nM2\n",
    "dense": SPIRAL,
}


@pytest.mark.parametrize(
    ("text", "added"),
    [
        ("G0 X30\nG1 Y10 F6000\nM2\n", PlatformSpeedLimit(MACHINE, 0.06)),
        ("G64 P0.1\nG1 X20 F6000\nG3 X-20 R20\nM2\n", FORCES),
    ],
    ids=["lines", "arc"],
)
def test_the_time_told_is_the_time_driven_with_added_bounds(text, added):
    program = read_program(text, SETTINGS)
    limits = SliderLimits.uniform(1.0, 40.0, 2000.0)
    bounded = limits.with_added(added)
    told = check_program(program, WORKSPACE, bounded)
    assert told.duration == pytest.approx(driven(program, bounded)[0], rel=0.01, abs=0.005)
    assert told.duration > 1.02 * check_program(program, WORKSPACE, limits).duration


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_time_told_is_the_time_driven(name):
    program = read_program(PROGRAMS[name], SETTINGS)
    told = check_program(program, WORKSPACE, LIMITS)
    duration, length, end = driven(program)
    assert told.duration == pytest.approx(duration, rel=0.01, abs=0.005)
    assert told.length == pytest.approx(length, rel=1e-3)
    assert told.duration == pytest.approx(sum(told.durations))
    last = [run for step in program.steps for run in step.runs][-1]
    path = at_once(last.segments.path_from(last.start))
    assert end == pytest.approx(np.array(path.end), abs=1e-6)


@pytest.mark.parametrize("name", ["lines", "exact"])
def test_the_time_told_has_that_of_a_shaper_at_stops(name):
    program = read_program(PROGRAMS[name], SETTINGS)
    shaper = Shaper.of(ShaperKind.ZV, Mode(15.0, 0.05))
    told = check_program(program, WORKSPACE, LIMITS, shaper)
    (run,) = [run for step in program.steps for run in step.runs]
    path = at_once(run.segments.path_from(run.start))
    assert told.is_shaped
    assert told.duration == pytest.approx(
        time_path(path, WORKSPACE, LIMITS, shaper).duration, rel=0.01
    )


def test_f_is_kept_where_the_limits_allow_it():
    told = checked("G1 X10 F600\nG2 X10 I-10 F1200\nM2\n")
    expected = 0.01 / 0.01 + 2.0 * np.pi * 0.01 / 0.02
    assert expected <= told.duration < 1.05 * expected


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("G0 X1\nG1 X500 F600\n", 2, "segment 2 "),
        ("G0 X1\n(a)\nM0\nG0 Z-100\nX0\n", 4, "segment 1 "),
        ("G0 X80\nG2 X-80 I-80 F600\nG2 X80 I5000 J0 F600\n", 3, ""),
    ],
)
def test_what_leads_outside_is_named_by_its_line(text, line, reason):
    with pytest.raises(ProgramError, match=f"program: line {line}.*{reason}") as caught:
        checked(text)
    assert caught.value.line == line
