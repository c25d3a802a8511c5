"""The words of G-code: when each is carried out, and what it does.

A command is a row of ``_ROWS`` and a function, which takes the words that it needs from the line
and changes a ``Machining``. What a line says is carried out in the order of RS274/NGC.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import IntEnum, auto
from functools import partial
from typing import NamedTuple

from tri_glide_kinematics.motion.path import LARGEST_ANGLE, SHORTEST
from tri_glide_kinematics.motion.path import LARGEST_PLACE as FAR
from tri_glide_kinematics.programs.arcs_and_holes import (
    CYCLES,
    MOST,
    Cycle,
    NoArcError,
    NoHoleError,
    arc,
    centre_of_radius,
)
from tri_glide_kinematics.programs.dialects import (
    CONCERNING,
    CUSTOMS,
    MILLIMETRE,
    MOTORS_OFF,
    Dialect,
)
from tri_glide_kinematics.programs.machining import AXES, CENTRES, Machining, Motion
from tri_glide_kinematics.programs.program import Dwell, ProgramStop, StopKind
from tri_glide_kinematics.programs.settings import NOWHERE, WORK_OFFSETS
from tri_glide_kinematics.programs.words import Line
from tri_glide_kinematics.vectors import Point

INCH = 25.4 * MILLIMETRE  # m


class Stage(IntEnum):
    """When something of a line is carried out. Between MOTION and STOP the platform moves."""

    ALWAYS = auto()
    UNITS = auto()
    FEED = auto()
    OVERRIDE = auto()
    TOOL = auto()
    SPINDLE = auto()
    OUTPUT = auto()
    MODE = auto()
    ONCE = auto()
    CYCLE = auto()
    NO_CYCLE = auto()
    MOTION = auto()
    STOP = auto()


# Carries out a command, or a word, that has this index in the line.
Act = Callable[[Machining, Line, int], None]


def _nothing(machine: Machining, line: Line, index: int) -> None:
    """Ask for what is always so."""


class Code(NamedTuple):
    """What is known of a command.

    Attributes:
        group: two commands of one group contradict each other.
        stage: when it is carried out.
        act: carries it out.
    """

    group: str
    stage: Stage = Stage.ALWAYS
    act: Act = _nothing


# Words that are no commands of their own


def _number_of_program(machine: Machining, line: Line, index: int) -> None:
    line.drop("O")
    machine.remarks.tell("O", "a number of a program means nothing here")


def _number_of_line(machine: Machining, line: Line, index: int) -> None:
    line.drop("N")


def _feed(machine: Machining, line: Line, index: int) -> None:
    value = line.take("F")
    if value is not None:
        machine.feed.ask(value * machine.modes.unit / machine.customs.feed_time)
        machine.check_speed(index, machine.feed.asked)
        if "M220" not in line.commands:
            machine.check_speed(index, machine.feed.speed)


def _tool_wanted(machine: Machining, line: Line, index: int) -> None:
    wanted = line.whole("T")
    if wanted is not None:
        machine.modes.tool_wanted = wanted
        if machine.customs.homes_whole and "M6" not in line.commands:
            machine.modes.tool = wanted
            machine.remarks.tell("T", "tools are not changed")


def _spindle_speed(machine: Machining, line: Line, index: int) -> None:
    """Take S, unless it belongs to another command of the line."""
    is_dwell = "G4" in line.commands and machine.customs.homes_whole
    turns = any(command in line.commands for command in ("M3", "M4", "M5"))
    if is_dwell or "M42" in line.commands or "M106" in line.commands:
        return
    if turns or "S" not in machine.customs.told_letters:
        speed = line.take("S")
        if speed is not None:
            machine.spindle.set_speed(speed)
            if not turns:
                machine.spindle.go_on_turning(machine.remarks.line)


# Speeds, tools and outputs


def _part_of_feed(machine: Machining, line: Line, index: int) -> None:
    part = line.take("S")
    if part is None or not part > 0.0:
        line.fail(index, "it needs an S above 0, the part of F in percent")
    machine.feed.drive_part(0.01 * part)
    if machine.feed.asked:
        machine.check_speed(index, machine.feed.speed)


def _change_tool(machine: Machining, line: Line, index: int) -> None:
    tool = machine.modes.tool = machine.modes.tool_wanted
    machine.writer.rest(ProgramStop(StopKind.TOOL, machine.remarks.line, tool))


def _turn(machine: Machining, line: Line, index: int, direction: float) -> None:
    machine.spindle.turn(direction, machine.remarks.line)


def _cool(machine: Machining, line: Line, index: int, names: str, is_on: float) -> None:
    for name in names.split():
        machine.spindle.cool(name, is_on, machine.remarks.line)


def _digital(machine: Machining, line: Line, index: int, value: float) -> None:
    output = line.whole("P")
    if output is None:
        line.fail(index, "it needs a P, the number of the output")
    machine.writer.put_out("digital", output, value, machine.remarks.line)


def _pin(machine: Machining, line: Line, index: int) -> None:
    output, value = line.whole("P"), line.take("S")
    if output is None or value is None:
        line.fail(index, "it needs P and S, the number of a pin and its value")
    machine.writer.put_out("pin", output, value, machine.remarks.line)


def _fan(machine: Machining, line: Line, index: int) -> None:
    place = line.index("S")
    speed = line.take("S")
    if speed is not None and speed < 0.0:
        line.fail(place, "the speed of a fan must be at least 0")
    value = 255.0 if speed is None else speed
    machine.writer.put_out("fan", line.whole("P") or 0, value, machine.remarks.line)


def _fan_off(machine: Machining, line: Line, index: int) -> None:
    machine.writer.put_out("fan", line.whole("P") or 0, 0.0, machine.remarks.line)


# What holds from now on


def _let(machine: Machining, line: Line, index: int, **modes: object) -> None:
    """Let some of the ``Modes`` hold."""
    for name, value in modes.items():
        setattr(machine.modes, name, value)


def _tool_offset(machine: Machining, line: Line, index: int) -> None:
    given = line.whole("H")
    tool = machine.modes.tool if given is None else given
    tools = machine.settings.tools
    if tool and tool not in tools:
        reason = f"no offset of tool {tool} is known: name it in the settings under tools"
        line.fail(index, reason)
    machine.offsets.set_tool(tools.get(tool, NOWHERE))


def _no_tool_offset(machine: Machining, line: Line, index: int) -> None:
    machine.offsets.set_tool(NOWHERE)


def _work_offset(machine: Machining, line: Line, index: int, name: str) -> None:
    machine.offsets.select(name)


def _no_tolerance(machine: Machining, line: Line, index: int) -> None:
    if machine.customs.restores_at_61:
        line.fail(index, "stored places are not understood: write the place instead")
    machine.modes.tolerance = 0.0


def _tolerance(machine: Machining, line: Line, index: int) -> None:
    given = line.take("P")
    line.take("Q")
    if given is not None and given < 0.0:
        line.fail(index, f"its tolerance P = {given:g} must be at least 0")
    tolerance = machine.settings.tolerance if given is None else given * machine.modes.unit
    if tolerance > FAR:
        line.fail(index, f"its tolerance {tolerance:g} m must be at most {FAR:g} m")
    machine.modes.tolerance = tolerance


# What holds for this line alone


def _dwell(machine: Machining, line: Line, index: int) -> None:
    duration = line.take("P")
    if duration is not None:
        duration *= machine.customs.dwell_unit
    elif machine.customs.homes_whole:
        duration = line.take("S")
    if duration is None or not duration >= 0.0:
        line.fail(index, "it needs a time, which is at least 0")
    machine.writer.rest(Dwell(duration, machine.remarks.line))


def _set_work_offset(machine: Machining, line: Line, index: int) -> None:
    line.axes_are_taken = True
    kind, number = line.whole("L"), line.whole("P") or 0
    if kind not in (2, 20) or number > len(WORK_OFFSETS):
        line.fail(index, f"only L2 and L20 with P0 to P{len(WORK_OFFSETS)} are understood")
    name = WORK_OFFSETS[number - 1] if number else machine.offsets.work
    told = {axis: line.take(letter) for axis, letter in enumerate(AXES)}
    unit = machine.modes.unit
    values = {axis: value * unit for axis, value in told.items() if value is not None}
    machine.offsets.set_work(name, values, machine.here if kind == 20 else None)


def _call_place(machine: Machining, line: Line, index: int) -> None:
    line.axes_are_taken = True
    named = line.having(AXES)
    if line.index("E") >= 0 and not named:
        return
    if not named and not machine.customs.resets_without_axes:
        line.fail(index, "it needs X, Y or Z: what the present place is to be called")
    unit = machine.modes.unit
    values = {AXES.index(axis): (line.take(axis) or 0.0) * unit for axis in named or AXES}
    machine.offsets.call(values, machine.here)


def _call_no_more(machine: Machining, line: Line, index: int, for_good: bool) -> None:
    machine.offsets.call_no_more(for_good=for_good)


def _call_again(machine: Machining, line: Line, index: int) -> None:
    machine.offsets.call_again()


def go_home(machine: Machining, line: Line, index: int) -> None:
    """Go where the settings say that the machine is at home."""
    line.axes_are_taken = True
    home = machine.settings.home
    if home is None:
        line.fail(index, "no such place is known: name it in the settings as home")
    machine.switch_motors(on=True)
    if machine.customs.homes_whole:
        for letter in "XYZWOL":
            line.drop(letter)
        machine.here[:] = home
        machine.offsets.call_no_more(for_good=False)
        machine.go(at_full_speed=True)
        machine.writer.finish()
        return
    named = line.having(AXES)
    machine.take_target(line)
    machine.go(at_full_speed=True)
    for axis in named or AXES:
        machine.here[AXES.index(axis)] = home[AXES.index(axis)]
    machine.go(at_full_speed=True)


# Motion


def _go_by(machine: Machining, line: Line, index: int, motion: Motion | None) -> None:
    """Let another ``motion`` hold; None for none."""
    machine.choose(motion)
    if line.axes_are_taken:
        line.fail(index, "another command takes the axes: write it on its own line")


def _move(machine: Machining, line: Line) -> None:
    """Carry out the motion of a line, if it has one."""
    motion = machine.modes.motion
    letters = line.having(motion.letters if motion else AXES)
    if line.axes_are_taken or not letters:
        return
    if motion is None:
        line.fail(line.index(letters[0]), "no G0 to G3 before it says how to go there")
    motion.drive(machine, line)


def _go_straight(machine: Machining, line: Line) -> None:
    machine.take_target(line, of_machine="G53" in line.commands)
    rapid = machine.modes.motion is RAPID
    machine.go(rapid=rapid, at_full_speed=rapid and not machine.customs.rapid_at_feed)


def _rise(machine: Machining, z: float, *, rapid: bool = True) -> None:
    """Go straight up or down to a height [m]."""
    machine.here[2] = z
    machine.go(rapid=rapid, at_full_speed=rapid and not machine.customs.rapid_at_feed)


def _drill(machine: Machining, line: Line) -> None:
    """Drill the holes of a line; what it does not say is as in the hole before."""
    modes, shift, here = machine.modes, machine.offsets.shift, machine.here
    index = line.index(line.having(AXES)[0])
    if "G53" in line.commands or modes.plane != (0, 1, 2):
        line.fail(index, "drilling cycles are understood along Z only: with G17, without G53")
    numbers = machine.holes.numbers
    for letter in "RZQP":
        value = line.take(letter)
        if value is not None:
            unit = machine.customs.dwell_unit if letter == "P" else modes.unit
            numbers[letter] = value * unit
    count = line.whole("L")
    if "Z" not in numbers or "R" not in numbers:
        line.fail(index, "a drilling cycle needs Z, the bottom, and R, where it begins")
    if count is not None and count > MOST:
        line.fail(index, f"there may be {MOST} holes in a line at most")
    steps = {axis: line.take(AXES[axis]) for axis in (0, 1)}
    # All holes of a line begin and end at the same heights.
    below = shift[2] if modes.absolute else here[2]
    clear = below + numbers["R"]
    bottom = numbers["Z"] + (below if modes.absolute else clear)
    code = modes.motion.name if modes.motion else ""
    try:
        cycle = Cycle(code, clear, bottom, numbers.get("Q"), numbers.get("P"))
    except NoHoleError as error:
        line.fail(index, str(error))
    for _ in range(1 if count is None else count):
        _rise(machine, max(clear, here[2]))
        for axis, value in steps.items():
            if value is not None:
                machine.step(axis, value, shift if modes.absolute else here)
        machine.go(at_full_speed=not machine.customs.rapid_at_feed)
        _rise(machine, clear)
        for stroke in cycle.strokes():
            _rise(machine, stroke.z, rapid=stroke.rapid)
            if stroke.rest:
                machine.writer.rest(Dwell(stroke.rest, machine.remarks.line))
        _rise(machine, max(clear, machine.holes.above) if modes.returns else clear)


class _ArcWords:
    """The words of an arc, taken from its line: R, two of I, J and K, and P."""

    def __init__(self, line: Line, plane: tuple[int, int, int]) -> None:
        p, q, along = plane
        self._names, self._fail = (CENTRES[p], CENTRES[q]), line.fail
        self._turns_index, self._turns = line.index("P"), line.whole("P")
        self._index = max(line.index(letter) for letter in (*self._names, "R"))
        self._centre = [line.take(letter) for letter in self._names]
        # Some CAM programs write all three; of the third only a zero is understood.
        spare = line.index(CENTRES[along])
        if line.take(CENTRES[along]):
            line.fail(spare, f"{CENTRES[along]} has no meaning in this plane (G17 to G19)")
        self._radius = line.take("R")

    def arc(
        self, ends: tuple[Point, Point], unit: float, zero: Point | None, clockwise: bool
    ) -> tuple[Point, float]:
        """Return the centre and the angle [rad] between two ``ends`` [m].

        Args:
            ends: of the arc in its plane.
            unit: of its words [m].
            zero: from which its centre is counted; None for its start [m].
            clockwise: how it turns.
        """
        p, q = self._names
        try:
            if self._radius is not None:
                if self._centre != [None, None]:
                    raise NoArcError("it has both R and a centre: one of them is enough")
                centre = centre_of_radius(*ends, self._radius * unit, clockwise)
            elif self._centre == [None, None]:
                raise NoArcError(f"it needs R, or {p} or {q} for its centre")
            elif zero is not None and None in self._centre:
                raise NoArcError(f"with G90.1 it needs {p} and {q}")
            else:
                (x, y), (i, j) = zero or ends[0], (unit * (word or 0.0) for word in self._centre)
                centre = x + i, y + j
            return arc(*ends, centre, clockwise)
        except NoArcError as error:
            self._fail(self._index, str(error))

    def turned(self, angle: float, less: int | None) -> float:
        """Return the ``angle`` with whole turns: P, ``less`` so many; None if P has no meaning."""
        if self._turns is None:
            return angle
        if less is None or self._turns < less:
            self._fail(self._turns_index, "so many turns have no meaning here")
        angle += math.copysign(2.0 * math.pi * (self._turns - less), angle)
        if abs(angle) > LARGEST_ANGLE:
            most = math.floor(LARGEST_ANGLE / (2.0 * math.pi)) - 1 + less
            self._fail(self._turns_index, f"there may be {most} turns at most")
        return angle


def _go_on_arc(machine: Machining, line: Line) -> None:
    if "G53" in line.commands:
        line.fail(line.commands["G53"], "it goes with G0 and G1 only")
    modes, shift = machine.modes, machine.offsets.shift
    p, q, along = modes.plane
    words, start = _ArcWords(line, modes.plane), tuple(machine.here)
    machine.take_target(line)
    end = tuple(machine.here)
    ends = ((start[p], start[q]), (end[p], end[q]))
    zero = (shift[p], shift[q]) if modes.absolute_centres else None
    centre, angle = words.arc(ends, modes.unit, zero, modes.motion is CLOCKWISE)
    angle = words.turned(angle, machine.customs.turns_given)
    size = abs(angle) * math.dist(ends[0], centre)
    rise = end[along] - start[along]
    if math.hypot(size, rise) < SHORTEST:
        return
    if size < SHORTEST:
        machine.go(rapid=False)
        return
    middle = [0.0, 0.0, 0.0]
    middle[p], middle[q], middle[along] = centre[0], centre[1], start[along]
    machine.add_arc(middle, angle, rise)


RAPID = Motion("G0", _go_straight)
STRAIGHT = Motion("G1", _go_straight)
CLOCKWISE = Motion("G2", _go_on_arc, AXES + CENTRES + "R")
ANTICLOCKWISE = Motion("G3", _go_on_arc, AXES + CENTRES + "R")
DRILLING = tuple(Motion(name, _drill, is_cycle=True) for name in CYCLES)


# Stops


def _wait(machine: Machining, line: Line, index: int, kind: StopKind) -> None:
    if kind is not StopKind.OPTIONAL or machine.settings.optional_stop:
        machine.writer.rest(ProgramStop(kind, machine.remarks.line))


def _end(machine: Machining, line: Line, index: int) -> None:
    machine.spindle.go_off(machine.remarks.line)
    machine.writer.rest(ProgramStop(StopKind.END, machine.remarks.line))
    machine.has_ended = True


# The commands of a row mean the same; those without an act ask for what is always so. Some mills
# know G70 and G71, too, and many programs have G80 beside G0. G53 is asked for by what moves.
_ROWS: Mapping[str, Code] = {
    "O": Code("O", Stage.ALWAYS, _number_of_program),
    "N": Code("N", Stage.ALWAYS, _number_of_line),
    "F": Code("F", Stage.FEED, _feed),
    "T": Code("T", Stage.TOOL, _tool_wanted),
    "S": Code("S", Stage.SPINDLE, _spindle_speed),
    "G20 G70": Code("units", Stage.UNITS, partial(_let, unit=INCH)),
    "G21 G71": Code("units", Stage.UNITS, partial(_let, unit=MILLIMETRE)),
    "M220": Code("speed", Stage.OVERRIDE, _part_of_feed),
    "M6": Code("tool", Stage.TOOL, _change_tool),
    "M3": Code("spindle", Stage.SPINDLE, partial(_turn, direction=1.0)),
    "M4": Code("spindle", Stage.SPINDLE, partial(_turn, direction=-1.0)),
    "M5": Code("spindle", Stage.SPINDLE, partial(_turn, direction=0.0)),
    "M7": Code("mist", Stage.OUTPUT, partial(_cool, names="mist", is_on=1.0)),
    "M8": Code("flood", Stage.OUTPUT, partial(_cool, names="flood", is_on=1.0)),
    "M9": Code("coolant", Stage.OUTPUT, partial(_cool, names="mist flood", is_on=0.0)),
    "M62 M64": Code("output", Stage.OUTPUT, partial(_digital, value=1.0)),
    "M63 M65": Code("output", Stage.OUTPUT, partial(_digital, value=0.0)),
    "M42": Code("output", Stage.OUTPUT, _pin),
    "M106": Code("fan", Stage.OUTPUT, _fan),
    "M107": Code("fan", Stage.OUTPUT, _fan_off),
    "M48 M49": Code("override"),
    "G17": Code("plane", Stage.MODE, partial(_let, plane=(0, 1, 2))),
    "G18": Code("plane", Stage.MODE, partial(_let, plane=(2, 0, 1))),
    "G19": Code("plane", Stage.MODE, partial(_let, plane=(1, 2, 0))),
    "G90": Code("distances", Stage.MODE, partial(_let, absolute=True)),
    "G91": Code("distances", Stage.MODE, partial(_let, absolute=False)),
    "G90.1": Code("distances of centres", Stage.MODE, partial(_let, absolute_centres=True)),
    "G91.1": Code("distances of centres", Stage.MODE, partial(_let, absolute_centres=False)),
    "G98": Code("retract", Stage.MODE, partial(_let, returns=True)),
    "G99": Code("retract", Stage.MODE, partial(_let, returns=False)),
    "G43": Code("tool offset", Stage.MODE, _tool_offset),
    "G49": Code("tool offset", Stage.MODE, _no_tool_offset),
    **{
        name: Code("work offset", Stage.MODE, partial(_work_offset, name=name))
        for name in WORK_OFFSETS
    },
    "G61": Code("tolerance", Stage.MODE, _no_tolerance),
    "G64": Code("tolerance", Stage.MODE, _tolerance),
    "G15": Code("polar"),
    "G40": Code("compensation"),
    "G53": Code("machine coordinates"),
    "G69": Code("rotation"),
    "G94": Code("mode of the feed"),
    "G97": Code("mode of the spindle"),
    "G4": Code("once", Stage.ONCE, _dwell),
    "G10": Code("once", Stage.ONCE, _set_work_offset),
    "G28": Code("once", Stage.ONCE, go_home),
    "G92": Code("once", Stage.ONCE, _call_place),
    "G92.1": Code("once", Stage.ONCE, partial(_call_no_more, for_good=True)),
    "G92.2": Code("once", Stage.ONCE, partial(_call_no_more, for_good=False)),
    "G92.3": Code("once", Stage.ONCE, _call_again),
    **{
        motion.name: Code("motion", Stage.CYCLE, partial(_go_by, motion=motion))
        for motion in DRILLING
    },
    "G80": Code("cycle", Stage.NO_CYCLE, partial(_go_by, motion=None)),
    "G0": Code("motion", Stage.MOTION, partial(_go_by, motion=RAPID)),
    "G1": Code("motion", Stage.MOTION, partial(_go_by, motion=STRAIGHT)),
    "G2": Code("motion", Stage.MOTION, partial(_go_by, motion=CLOCKWISE)),
    "G3": Code("motion", Stage.MOTION, partial(_go_by, motion=ANTICLOCKWISE)),
    "M0 M25 M60 M226 M600 M601": Code("stop", Stage.STOP, partial(_wait, kind=StopKind.PAUSE)),
    "M1": Code("stop", Stage.STOP, partial(_wait, kind=StopKind.OPTIONAL)),
    "M2 M30": Code("stop", Stage.STOP, _end),
}
CODES = {name: code for names, code in _ROWS.items() for name in names.split()}
_WORDS = "".join(name for name in CODES if name.isalpha())

# Advice for commands that are known and not understood.
_MAP_HELP = "no map of a bed is known here: calibrate the machine, and name this under ignored"
_OFFSET_HELP = "name offsets and tools in the settings, or use G92"
_ADVICE = {
    "G41 G41.1 G42 G42.1": "let the CAM program compensate for the cutter itself",
    "G74 G76 G84 G86 G87 G88": "let the CAM program write cycles as lines",
    "G5 G5.1 G5.2 G5.3": "let the CAM program write splines as lines or arcs",
    "G93 G95": "let the CAM program write F as a length per minute (G94)",
    "G16 G50 G51 G68": "let the CAM program scale and turn the places itself",
    "G38.2 G38.3 G38.4 G38.5 G30 G31 M401 M402 M585": "nothing is probed while a program runs",
    "G28.1 G30.1": "name the place in the settings",
    "G43.1 G43.2": "name the tools in the settings, and use G43",
    "G7 G8": "this machine is no lathe",
    "G27": "write the place as a line",
    "G33 G33.1": "no thread is cut here",
    "G52": "use G92 or G54 to G59.3",
    "G61.1": "use G61: the path stops wherever it is not smooth",
    "G96": "use G97",
    "G29 M420": _MAP_HELP,
    "M206 M428 M218 M290 M851": _OFFSET_HELP,
    "M92 M665 M666": "the geometry is that of the parameters of the machine",
    "M23 M24 M26 M32": "a program drives no other file",
    "M120 M121": "stored states are not restored: write G90 or G91, and F",
    "M501 M502": "it would change offsets: write those of the program itself",
    "M97 M98 M99": "write out what it calls; if that does not move the tool, name it under ignored",
    "M66 M67 M68": "nothing is read and no voltage set here: see M62 to M65",
    "M208": "the workspace is that of the machine: take it away, or name it under ignored",
}
_HELP = {name: text for names, text in _ADVICE.items() for name in names.split()}
IGNORED_HELP = "if it does not concern the motion, name it in the settings under ignored"


def help_of(name: str) -> str:
    """Return what helps where a command, or a name, is not understood."""
    if name in _HELP:
        return _HELP[name]
    if name.startswith("BED_MESH_"):
        return _MAP_HELP
    others = [
        dialect.value
        for dialect, customs in CUSTOMS.items()
        if name in customs.told or name.startswith(customs.names)
    ]
    if not others:
        return IGNORED_HELP
    return f"it is a word of {', '.join(others)}: name this dialect in the settings"


def carry_out(machine: Machining, line: Line) -> None:
    """Carry out a line, in the order of RS274/NGC."""
    if _is_told(machine, line):
        return
    _check(line)
    names = sorted((*line.having(_WORDS), *line.commands), key=lambda name: CODES[name].stage)
    acts = [(CODES[name], line.commands.get(name, line.index(name))) for name in names]
    for code, index in acts:
        if code.stage < Stage.STOP:
            code.act(machine, line, index)
    _move(machine, line)
    _take_told_letters(machine, line)
    line.finish()
    for code, index in acts:
        if code.stage is Stage.STOP:
            code.act(machine, line, index)


def _check(line: Line) -> None:
    """Check that all commands are known, and that no two contradict each other."""
    found: dict[str, str] = {}
    for name, index in line.commands.items():
        if name not in CODES:
            line.fail(index, f"this command is not understood: {help_of(name)}")
        other = found.setdefault(CODES[name].group, name)
        if other != name:
            line.fail(index, f"it contradicts {other} on the same line: make two lines of it")


# What does not concern the motion: it is told, and not done.


def _is_told(machine: Machining, line: Line) -> bool:
    """Return whether a line has a command that does not concern the motion."""
    ignored = machine.settings.ignored
    for name, index in line.commands.items():
        if name not in machine.customs.told and name not in ignored:
            continue
        # The words before it are not its own.
        moves = any(0 <= line.index(letter) < index for letter in f"{AXES}{CENTRES}FART")
        if moves or len(line.commands) > 1:
            line.fail(index, "write it on a line of its own: it does not concern the motion")
        if name not in ignored and _concerns(machine, name, line, index):
            return False
        machine.remarks.tell(name, "it does not concern the motion")
        return True
    return False


def _concerns(machine: Machining, name: str, line: Line, index: int) -> bool:
    """Return whether a told command sets a work offset; with some words it is an error."""
    if name == "G10" and line.index("L") >= 0 and machine.dialect is Dialect.REPRAP:
        return True
    for letter in line.having(CONCERNING.get(name, "")):
        if line.take(letter) or name == "G10":
            reason = _MAP_HELP if name == "M420" else _OFFSET_HELP
            line.fail(index, f"with {letter} it concerns the motion: {reason}")
    if name in MOTORS_OFF and (line.having(AXES) or not line.having("SE")):
        machine.switch_motors(on=False)
    return False


def _take_told_letters(machine: Machining, line: Line) -> None:
    letters = machine.customs.told_letters
    for letter in letters:
        if line.drop(letter):
            if letter == "E" and "A" not in letters:
                tell_extrusion(machine)
            else:
                machine.remarks.tell(letter, "the limits of the machine count")


def tell_extrusion(machine: Machining) -> None:
    """Tell that no extruder is driven."""
    machine.remarks.tell("E", "extrusion is told, not driven")
