"""The meaning of a program in G-code: paths, dwells, outputs and stops.

A line says at most one motion and what holds from then on; what it says is carried out in the order
of RS274/NGC (docs/programs.md). Whatever is not understood is an error with line and column, before
anything moves. Positions are those of the platform in metres, whatever the units of the program.
"""

from __future__ import annotations

import hashlib
import math
from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, NoReturn

import numpy as np

from tri_glide_kinematics.motion.path import (
    LARGEST_ANGLE,
    LARGEST_SPEED,
    LEAST_SPEED,
    MOST_SEGMENTS,
    SHORTEST,
    FlatPath,
    SegmentKind,
)
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
from tri_glide_kinematics.programs.guessing import guess_dialect
from tri_glide_kinematics.programs.program import (
    Dwell,
    Output,
    PathRun,
    Program,
    ProgramStop,
    Step,
    StopKind,
    Told,
)
from tri_glide_kinematics.programs.settings import (
    CONCERNING,
    CUSTOMS,
    MILLIMETRE,
    MOTORS_OFF,
    NOWHERE,
    TEXTS,
    WORK_OFFSETS,
    Customs,
    Dialect,
    ProgramSettings,
)
from tri_glide_kinematics.programs.words import (
    NAMED,
    PERCENT,
    Block,
    ProgramError,
    TellPart,
    WordReader,
    tell_nobody,
)
from tri_glide_kinematics.vectors import Point, Vector3, three
from tri_glide_kinematics.wording import number_text

INCH = 25.4 * MILLIMETRE  # m

# By tenfold numbers of G; some mills know G70 and G71, too [m].
_UNITS = {200: INCH, 700: INCH, 210: MILLIMETRE, 710: MILLIMETRE}

# Steps whose square is shorter make no segment [m^2].
SHORTEST_SQUARED = SHORTEST * SHORTEST

AXES = "XYZ"
OFFSETS = "IJK"


# Commands of one group contradict each other; numbers are tenfold. Those of the last groups mean
# nothing here: they ask for what is always so.
_G_GROUPS: Mapping[int, str] = MappingProxyType(
    {
        **dict.fromkeys((0, 10, 20, 30, *CYCLES), "motion"),
        800: "cycle",
        **dict.fromkeys((40, 100, 280, 920, 921, 922, 923), "once"),
        **dict.fromkeys((170, 180, 190), "plane"),
        **dict.fromkeys(_UNITS, "units"),
        **dict.fromkeys((900, 910), "distances"),
        **dict.fromkeys((901, 911), "distances of centres"),
        **dict.fromkeys((430, 490), "tool offset"),
        **dict.fromkeys((540, 550, 560, 570, 580, 590, 591, 592, 593), "work offset"),
        **dict.fromkeys((610, 640), "tolerance"),
        **{
            150: "polar",
            690: "rotation",
            530: "machine coordinates",
            400: "compensation",
            940: "feed",
            970: "spindle",
        },
        **dict.fromkeys((980, 990), "retract"),
    }
)
_M_GROUPS: Mapping[int, str] = MappingProxyType(
    {
        **dict.fromkeys((0, 10, 20, 300, 600, 250, 2260, 6000, 6010), "stop"),
        **dict.fromkeys((30, 40, 50), "spindle"),
        **{60: "tool", 70: "mist", 80: "flood", 90: "coolant"},
        **dict.fromkeys((480, 490), "override"),
        **dict.fromkeys((420, 620, 630, 640, 650), "output"),
        **dict.fromkeys((1060, 1070), "fan"),
        2200: "speed",
    }
)
_PAUSES = {0: StopKind.PAUSE, 10: StopKind.OPTIONAL, 600: StopKind.PAUSE, 250: StopKind.PAUSE}
_PAUSES |= dict.fromkeys((2260, 6000, 6010), StopKind.PAUSE)
_ENDS = (20, 300)

# Advice for commands that are known and not understood.
_MAP_HELP = "no map of a bed is known here: calibrate the machine, and name this under ignored"
_HELP = {
    **dict.fromkeys((410, 411, 420, 421), "let the CAM program compensate for the cutter itself"),
    **dict.fromkeys((740, 760, 840, 860, 870, 880), "let the CAM program write cycles as lines"),
    **dict.fromkeys((50, 51, 52, 53), "let the CAM program write splines as lines or arcs"),
    **dict.fromkeys((930, 950), "let the CAM program write F as a length per minute (G94)"),
    **dict.fromkeys((382, 383, 384, 385, 300, 310), "nothing is probed while a program runs"),
    **dict.fromkeys((281, 301), "name the place in the settings"),
    **dict.fromkeys((431, 432), "name the tools in the settings, and use G43"),
    **dict.fromkeys((70, 80), "this machine is no lathe"),
    290: _MAP_HELP,
    611: "use G61: the path stops wherever it is not smooth",
    960: "use G97",
    **dict.fromkeys((160, 500, 510, 680), "let the CAM program scale and turn the places itself"),
    **dict.fromkeys((330, 331), "no thread is cut here"),
    270: "write the place as a line",
    520: "use G92 or G54 to G59.3",
}
_OFFSET_HELP = "name offsets and tools in the settings, or use G92"
_CALL_HELP = "write out what it calls; if that does not move the tool, name it under ignored"
_HELP_OF_M = {
    **dict.fromkeys((2060, 4280, 2180, 2900, 8510), _OFFSET_HELP),
    **dict.fromkeys((920, 6650, 6660), "the geometry is that of the parameters of the machine"),
    **dict.fromkeys((230, 240, 260, 320), "a program drives no other file"),
    **dict.fromkeys((1200, 1210), "stored states are not restored: write G90 or G91, and F"),
    **dict.fromkeys((4010, 4020, 5850), "nothing is probed while a program runs"),
    **dict.fromkeys((5010, 5020), "it would change offsets: write those of the program itself"),
    **dict.fromkeys((970, 980, 990), _CALL_HELP),
    **dict.fromkeys((660, 670, 680), "nothing is read and no voltage set here: see M62 to M65"),
    2080: "the workspace is that of the machine: take it away, or name it under ignored",
    4200: _MAP_HELP,
}
_JOG_HELP = "write what is to be driven as lines of G1, and not as jogs"
# So many commands that are not understood are named at once.
MOST_NAMES = 8
_IGNORED_HELP = "if it does not concern the motion, name it in the settings under ignored"


class _Straight(NamedTuple):
    """Where the words of a line with a straight move stand; -1 for none."""

    g: int
    x: int
    y: int
    z: int
    f: int


def _straight(letters: str) -> _Straight | None:
    """Return where the words of a line are, if it can be no other than a straight move."""
    if len(set(letters)) < len(letters) or not set(letters) <= set("NGXYZFE"):
        return None
    return _Straight(*(letters.find(letter) for letter in "GXYZF"))


def read_program(
    text: str | bytes,
    settings: ProgramSettings | None = None,
    file: str | Path = "program",
    tell_part: TellPart = tell_nobody,
) -> Program:
    """Find out what a program means.

    Args:
        text: of the program.
        settings: what it does not say itself.
        file: where it is from, for the texts of errors.
        tell_part: gets which part of it is read, now and then.

    Raises:
        ProgramError: if something in it is not understood.
    """
    data = text.encode() if isinstance(text, str) else text
    settings = settings or ProgramSettings()
    if settings.dialect is not None:
        return _Interpreter(str(file), data, settings, settings.dialect).program(tell_part)
    guess = guess_dialect(data)
    dialect = guess.dialect if guess else Dialect.NIST
    program = _Interpreter(str(file), data, settings, dialect).program(tell_part)
    return replace(program, guess=str(guess or "read as nist: nothing shows another dialect"))


class _Offsets:
    """What is added to a place in the program, by work offsets, G92 and the tool.

    Attributes:
        work: name of the work offset in force.
        shift: their sum. Shape (3,) [m].
    """

    def __init__(self, settings: ProgramSettings) -> None:
        self.work = "G54"
        self.shift = [0.0, 0.0, 0.0]
        self._of_work = {name: settings.offsets.get(name, NOWHERE) for name in WORK_OFFSETS}
        self._set_off = self._set_off_before = self._of_tool = NOWHERE
        self._find_shift()

    def select(self, work: str) -> None:
        """Let another work offset hold."""
        self.work = work
        self._find_shift()

    def set_tool(self, offset: Vector3) -> None:
        """Let the offset of another tool hold [m]."""
        self._of_tool = offset
        self._find_shift()

    def set_work(
        self, name: str, values: Mapping[int, float], here: Sequence[float] | None
    ) -> None:
        """Set a work offset for some axes [m]; with ``here``, so that this place has the values."""
        offset = list(self._of_work[name])
        for axis, value in values.items():
            offset[axis] = value
            if here is not None:
                offset[axis] = here[axis] - self._set_off[axis] - self._of_tool[axis] - value
        self._of_work[name] = three(offset)
        self._find_shift()

    def call(self, values: Mapping[int, float], here: Sequence[float]) -> None:
        """Let the place ``here`` have other values for some axes [m] (G92)."""
        set_off, work = list(self._set_off), self._of_work[self.work]
        for axis, value in values.items():
            set_off[axis] = here[axis] - work[axis] - self._of_tool[axis] - value
        self._set_off = self._set_off_before = three(set_off)
        self._find_shift()

    def call_no_more(self, *, for_good: bool) -> None:
        """Let G92 hold no more; ``call_again`` takes it up unless it is ``for_good``."""
        self._set_off = NOWHERE
        if for_good:
            self._set_off_before = NOWHERE
        self._find_shift()

    def call_again(self) -> None:
        """Let G92 hold again."""
        self._set_off = self._set_off_before
        self._find_shift()

    def _find_shift(self) -> None:
        self.shift[:] = map(sum, zip(self._of_work[self.work], self._set_off, self._of_tool))


class _Writer:
    """Collects the steps of a program, segment by segment.

    Attributes:
        steps: that are complete.
        end: where the last segment ends. Shape (3,) [m].
        count: how many segments the present path has.
    """

    def __init__(self, begin: Vector3) -> None:
        self.steps: list[Step] = []
        self.end = list(begin)
        self._begin()

    def _begin(self) -> None:
        self._start = list(self.end)
        self.count = 0
        self._kinds = array("B")
        self._numbers = array("d")
        self._speeds = array("d")
        self._tolerances = array("d")
        self._lines = array("i")
        self._rapid = array("b")
        self._outputs: list[Output] = []

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to do so far."""
        return not (self.steps or self.count or self._outputs)

    def add(
        self,
        kind: int,
        numbers: Sequence[float],
        end: Sequence[float],
        bounds: tuple[float, float],
        line: int,
        rapid: bool,
    ) -> None:
        """Add a segment that ends at ``end`` [m], with tolerance [m] and speed [m/s] as bounds."""
        self.end[:] = end
        self._kinds.append(kind)
        self._numbers.extend(numbers)
        tolerance, speed = bounds
        self._tolerances.append(tolerance)
        self._speeds.append(speed)
        self._lines.append(line)
        self._rapid.append(rapid)
        self.count += 1

    def put_out(self, name: str, number: int, value: float, line: int) -> None:
        """Change an output where the platform is then."""
        self._outputs.append(Output(name, number, value, line, self.count))

    def has_done(self, line: int) -> bool:
        """Return whether the last thing that is done is that of a ``line``."""
        last = self._lines[-1] if self.count else 0
        return line in (last, *(each.line_at() for each in (*self._outputs, *self.steps[-1:])))

    def rest(self, step: Dwell | ProgramStop) -> None:
        """Do a ``step`` at the end of the path so far."""
        self.finish()
        self.steps.append(step)

    def finish(self) -> None:
        """Put the path so far into a step, and the outputs before and after it."""
        count = self.count
        self.steps += (output for output in self._outputs if output.joint == 0)
        if count:
            self.steps.append(self._run(count))
        after = (output for output in self._outputs if output.joint >= count > 0)
        self.steps += (replace(output, joint=0) for output in after)
        self._begin()

    def _run(self, count: int) -> PathRun:
        lines = np.frombuffer(self._lines, np.int32)
        kinds, numbers = np.frombuffer(self._kinds, np.uint8), np.frombuffer(self._numbers)
        bounds = np.frombuffer(self._tolerances), np.frombuffer(self._speeds)
        segments = FlatPath.of(kinds, numbers, *bounds, 0.0)
        inner = tuple(output for output in self._outputs if 0 < output.joint < count)
        return PathRun(
            three(self._start), segments, lines, np.frombuffer(self._rapid, np.bool_), inner
        )


class _Outputs:
    """Spindle, coolant, fans and pins, which change where the platform is then."""

    def __init__(self, writer: _Writer, customs: Customs) -> None:
        self._writer = writer
        self._customs = customs
        self._spindle = 0.0
        self._spindle_speed = 0.0
        self._coolant: set[str] = set()

    def take(self, line: _Line, number: int) -> None:
        """Put out what a ``line`` with this ``number`` says."""
        self._set_spindle(line, number)
        for code in line.m:
            if code in _COOLANT:
                for name, is_on in _COOLANT[code]:
                    self._writer.put_out(name, 0, is_on, number)
                    (self._coolant.add if is_on else self._coolant.discard)(name)
            elif code in _DIGITAL:
                output = line.whole("P")
                if output is None:
                    line.fail(line.m[code], "it needs a P, the number of the output")
                self._writer.put_out("digital", output, _DIGITAL[code], number)
            elif code == 420:
                output, value = line.whole("P"), line.take("S")
                if output is None or value is None:
                    line.fail(line.m[code], "it needs P and S, the number of a pin and its value")
                self._writer.put_out("pin", output, value, number)
            elif code in (1060, 1070):
                index = line.index("S")
                speed = line.take("S") if code == 1060 else 0.0
                if speed is not None and speed < 0.0:
                    line.fail(index, "the speed of a fan must be at least 0")
                fan = 255.0 if speed is None else speed
                self._writer.put_out("fan", line.whole("P") or 0, fan, number)

    def _set_spindle(self, line: _Line, number: int) -> None:
        turns = next((turn for code, turn in _SPINDLE if code in line.m), None)
        other = 420 in line.m or 1060 in line.m or (40 in line.g and self._customs.homes_whole)
        speed = None
        if not other and (turns is not None or "S" not in self._customs.told_letters):
            speed = line.take("S")
        if speed is not None:
            self._spindle_speed = speed
        if turns is not None:
            self._spindle = turns
        if turns is not None or (speed is not None and self._spindle):
            turning = self._spindle * self._spindle_speed + 0.0
            self._writer.put_out("spindle", 0, turning, number)

    def go_off(self, number: int) -> None:
        """Put out nothing any more, as the line with this ``number`` ends the program."""
        if self._spindle:
            self._writer.put_out("spindle", 0, 0.0, number)
        for name in sorted(self._coolant):
            self._writer.put_out(name, 0, 0.0, number)


class _ArcWords:
    """The words of an arc, taken from its line: R, two of I, J and K, and P."""

    def __init__(self, line: _Line, plane: tuple[int, int, int]) -> None:
        p, q, along = plane
        self._names, self._fail = (OFFSETS[p], OFFSETS[q]), line.fail
        self._turns_index, self._turns = line.index("P"), line.whole("P")
        self._index = max(line.index(letter) for letter in (*self._names, "R"))
        self._centre = [line.take(letter) for letter in self._names]
        # Some CAM programs write all three; of the third only a zero is understood.
        spare = line.index(OFFSETS[along])
        if line.take(OFFSETS[along]):
            line.fail(spare, f"{OFFSETS[along]} has no meaning in this plane (G17 to G19)")
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


class _Interpreter:
    """Goes through the lines of one program, with what holds at each."""

    def __init__(self, file: str, data: bytes, settings: ProgramSettings, dialect: Dialect) -> None:
        self._file = file
        self._settings = settings
        self._dialect = dialect
        self._customs = CUSTOMS[dialect]
        self._size, self._digest = len(data), hashlib.sha256(data).hexdigest()
        read = (MOTORS_OFF | CONCERNING.keys()) - settings.ignored
        texts = (TEXTS | self._customs.told | settings.ignored) - read
        skips, extrudes = settings.block_delete, self._customs.extrudes
        self._reader = WordReader(file, data, texts, skips, extrudes)
        self._line = 0
        # Line that switches the motors off, 0 for none, and the largest number of segments of a
        # path.
        self._motors_off = 0
        self._most = MOST_SEGMENTS
        self._is_after_percent = False
        self._ended = False
        self._told: dict[str, Told] = {}
        self._straight: dict[str, _Straight | None] = {}
        # The modes, offsets and numbers in force.
        self._motion: int | None = None
        self._unit = MILLIMETRE
        self._plane = (0, 1, 2)
        self._absolute = True
        self._absolute_centres = False
        self._offsets = _Offsets(settings)
        self._tool = self._tool_wanted = 0
        self._tolerance = settings.tolerance
        self._feed = self._customs.first_feed if settings.feed is None else settings.feed
        self._part_of_feed = 1.0
        # Of drilling cycles: the numbers that still hold, by their letters; where they began, and
        # whether the tool goes back there behind each hole.
        self._drilled: dict[str, float] = {}
        self._above, self._returns = 0.0, True
        # The place that the platform is sent to; the last segment ends hardly elsewhere.
        self._here = list(settings.begin)
        self._writer = _Writer(settings.begin)
        self._outputs = _Outputs(self._writer, self._customs)

    def program(self, tell_part: TellPart) -> Program:
        """Return the whole program."""
        lines = 0
        for block in self._reader.blocks(tell_part):
            lines += len(block.ends)
            if not self._ended:
                self._read(block)
        if not self._ended:
            self._check_end(lines)
        self._writer.finish()
        if not self._writer.steps:
            raise ProgramError(self._file, 0, 0, "", "it says nothing that can be done")
        told = tuple(self._told.values())
        steps = tuple(self._writer.steps)
        return Program(self._file, steps, told, lines, self._size, self._digest)

    # Lines

    def _read(self, block: Block) -> None:
        """Carry out the lines of a block, up to the end of the program."""
        letters, values = block.letters, block.values
        # Most lines have the same letters as others before.
        straight = self._straight
        begin = 0
        for index, end in enumerate(block.ends):
            if end == begin:
                if index in block.unusual:
                    self._line = block.first + index
                    self._read_alone()
                    if self._ended:
                        return
                continue
            self._line = block.first + index
            spelled = letters[begin:end]
            if spelled not in straight:
                straight[spelled] = _straight(spelled)
                if "E" in spelled and straight[spelled]:
                    self._tell_extrusion()
            places = straight[spelled]
            if places is None or not self._move_straight(values, begin, places):
                self._carry_out(_Line(spelled, values[begin:end], self._fail))
                if self._ended:
                    return
            begin = end

    def _read_alone(self) -> None:
        """Carry out a line that is not ordinary."""
        words = self._reader.words_of(self._line)
        if not words:
            return
        if words[0].letter == PERCENT:
            # The first one may begin the program, the second one ends it.
            is_begun = not self._writer.is_empty
            self._ended = self._is_after_percent or is_begun or self._motion is not None
            if self._ended and words[0].text.strip(PERCENT):
                self._fail(0, "only % alone ends a program: take away what stands behind it")
            self._is_after_percent = True
            return
        for index, word in enumerate(words):
            if word.letter == NAMED:
                self._carry_out_name(word.text.upper(), index)
                return
        letters = "".join(word.letter for word in words)
        self._carry_out(_Line(letters, [word.value for word in words], self._fail))

    def _carry_out_name(self, name: str, index: int) -> None:
        """Carry out a line that begins with a name, or an order to grbl."""
        if name == "$H" and self._dialect is Dialect.GRBL:
            self._go_home(_Line("", (), self._fail), index)
        elif name.startswith("$J") or not self._is_told_name(name):
            help_text = _JOG_HELP if name.startswith("$J") else self._help_of(name)
            if help_text is _IGNORED_HELP:
                names = [each for each in self._reader.names() if not self._is_told_name(each)]
                help_text += f": {', '.join(names[:MOST_NAMES])}"
            self._fail(index, f"this command is not understood: {help_text}")
        else:
            self._tell(name, "it does not concern the motion")

    def _is_told_name(self, name: str) -> bool:
        return name in self._settings.ignored or name.startswith(self._customs.names)

    def _help_of(self, name: str) -> str:
        """Return what helps where a command is not understood."""
        if name.startswith("BED_MESH_"):
            return _MAP_HELP
        others = [
            dialect.value
            for dialect, customs in CUSTOMS.items()
            if name in customs.told or name.startswith(customs.names)
        ]
        if not others:
            return _IGNORED_HELP
        return f"it is a word of {', '.join(others)}: name this dialect in the settings"

    def _check_end(self, lines: int) -> None:
        """Check that a program without an end of its own is not cut off.

        A last line without an end may be part of a longer one, which matters if it does something.
        """
        self._line = lines
        if self._reader.ends_in_a_line and lines and self._writer.has_done(lines):
            reason = "this last line has no end, and the program none (M2, M30 or %), so it may be "
            self._fail(-1, f"{reason}cut off: if it is whole, end the line")

    def _fail(self, index: int, reason: str) -> NoReturn:
        """Raise the error about a word of the present line; negative for all of it."""
        raise self._reader.error(self._line, index, reason)

    def _tell(self, word: str, reason: str) -> None:
        if word not in self._told:
            self._told[word] = Told(word, self._line, reason)

    def _tell_extrusion(self) -> None:
        self._tell("E", "extrusion is told, not driven")

    # Straight moves

    def _move_straight(self, values: Sequence[float], begin: int, places: _Straight) -> bool:
        """Carry out a line with a straight move, or with F alone; return whether it is one.

        If not, nothing has been done.
        """
        g, x, y, z, f = places
        motion = self._motion
        if g >= 0:
            code = values[begin + g]
            if code == 1.0:
                motion = 10
            elif code == 0.0:
                motion = 0
            else:
                return False
        if motion != 10 and motion != 0:
            return False
        if f >= 0:
            feed = values[begin + f] * self._unit / self._customs.feed_time
            if not LEAST_SPEED <= feed * self._part_of_feed <= LARGEST_SPEED:
                return False
            self._feed = feed
        self._motion = motion
        here, end = self._here, self._writer.end
        unit = self._unit
        if self._absolute:
            shift = self._offsets.shift
            if x >= 0:
                here[0] = values[begin + x] * unit + shift[0]
            if y >= 0:
                here[1] = values[begin + y] * unit + shift[1]
            if z >= 0:
                here[2] = values[begin + z] * unit + shift[2]
        else:
            if x >= 0:
                here[0] += values[begin + x] * unit
            if y >= 0:
                here[1] += values[begin + y] * unit
            if z >= 0:
                here[2] += values[begin + z] * unit
        dx, dy, dz = here[0] - end[0], here[1] - end[1], here[2] - end[2]
        if dx * dx + dy * dy + dz * dz >= SHORTEST_SQUARED:
            self._add_line(motion == 0, motion == 0 and not self._customs.rapid_at_feed)
        return True

    def _add_line(self, rapid: bool, at_full_speed: bool) -> None:
        """Add the line from the end of the last segment to where the platform is sent."""
        if self._writer.count >= self._most:
            self._begin_another_path()
        here = self._here
        x, y, z = here
        if not (-FAR < x < FAR and -FAR < y < FAR and -FAR < z < FAR):
            self._fail_far()
        bounds = self._tolerance, 0.0 if at_full_speed else self._speed()
        self._writer.add(0, here, here, bounds, self._line, rapid)

    def _begin_another_path(self) -> None:
        """Stop there, as this path can have no more segments."""
        if self._motors_off:
            reason = f"the motors are off since line {self._motors_off}: write G28 before it"
            self._fail(-1, reason)
        self._tell("stop", f"the platform stops there: a path has {MOST_SEGMENTS} segments")
        self._writer.finish()

    def _speed(self) -> float:
        """Return the speed that F asks for [m/s]."""
        if self._feed == 0.0:
            per = "mm/s" if self._customs.feed_time == 1.0 else "mm/min"
            words = self._reader.words_of(self._line)
            index = next((n for n, word in enumerate(words) if word.letter in AXES + OFFSETS), -1)
            reason = f"no F says how fast this is: write one, such as F600 ({per}), before it"
            self._fail(index, reason)
        return self._feed * self._part_of_feed

    def _fail_far(self) -> NoReturn:
        self._fail(-1, f"it leads farther than {FAR:g} m: are its units right?")

    # All other lines

    def _carry_out(self, line: _Line) -> None:
        """Carry out a line, in the order of RS274/NGC."""
        if self._is_told(line):
            return
        line.check(line.g, "G", _G_GROUPS, self._help_of)
        line.check(line.m, "M", _M_GROUPS, self._help_of)
        if line.drop("O"):
            self._tell("O", "a number of a program means nothing here")
        line.drop("N")
        self._set_units(line)
        self._set_feed(line)
        self._set_tool(line)
        self._outputs.take(line, self._line)
        self._set_modes(line)
        axes_are_taken = self._do_once(line)
        self._move(line, axes_are_taken)
        self._take_told(line)
        line.finish()
        self._stop(line)

    def _is_told(self, line: _Line) -> bool:
        """Return whether a line has a command that does not concern the motion."""
        names = {f"G{code / 10:g}": index for code, index in line.g.items()}
        names |= {f"M{code / 10:g}": index for code, index in line.m.items()}
        for name, index in names.items():
            if name not in self._customs.told and name not in self._settings.ignored:
                continue
            if len(names) > 1:
                self._fail(index, "write it on a line of its own: it does not concern the motion")
            if name not in self._settings.ignored and self._concerns(name, line, index):
                return False
            self._tell(name, "it does not concern the motion")
            return True
        return False

    def _concerns(self, name: str, line: _Line, index: int) -> bool:
        """Return whether a told command sets a work offset; with some words it is an error."""
        if name == "G10" and line.index("L") >= 0 and self._dialect is Dialect.REPRAP:
            return True
        for letter in CONCERNING.get(name, ""):
            if line.index(letter) >= 0 and (line.take(letter) or name == "G10"):
                reason = _MAP_HELP if name == "M420" else _OFFSET_HELP
                self._fail(index, f"with {letter} it concerns the motion: {reason}")
        if name in MOTORS_OFF:
            axes = any(line.index(letter) >= 0 for letter in AXES)
            if axes or (line.index("S") < 0 and line.index("E") < 0):
                self._writer.finish()
                self._motors_off, self._most = self._line, 0
        return False

    def _take_told(self, line: _Line) -> None:
        for letter in self._customs.told_letters:
            if line.drop(letter):
                if letter == "E" and "A" not in self._customs.told_letters:
                    self._tell_extrusion()
                else:
                    self._tell(letter, "the limits of the machine count")

    def _set_units(self, line: _Line) -> None:
        for code in line.g.keys() & _UNITS:
            self._unit = _UNITS[code]

    def _set_feed(self, line: _Line) -> None:
        index = line.index("F")
        value = line.take("F")
        if value is not None:
            self._feed = value * self._unit / self._customs.feed_time
            self._check_speed(index, self._feed)
        if 2200 in line.m:
            part = line.take("S")
            if part is None or not part > 0.0:
                self._fail(line.m[2200], "it needs an S above 0, the part of F in percent")
            self._part_of_feed = 0.01 * part
            index = line.m[2200]
        if self._feed and index >= 0:
            self._check_speed(index, self._feed * self._part_of_feed)

    def _check_speed(self, index: int, speed: float) -> None:
        """Check a ``speed`` [m/s] that the word with this index says."""
        if not LEAST_SPEED <= speed <= LARGEST_SPEED:
            bound, side = (LEAST_SPEED, "least") if speed < LEAST_SPEED else (LARGEST_SPEED, "most")
            told, limit = (number_text(each / MILLIMETRE, 6, 0.0) for each in (speed, bound))
            self._fail(index, f"the speed {told} mm/s must be at {side} {limit} mm/s")

    def _set_tool(self, line: _Line) -> None:
        wanted = line.whole("T")
        if wanted is not None:
            self._tool_wanted = wanted
        if 60 in line.m:
            self._tool = self._tool_wanted
            self._writer.rest(ProgramStop(StopKind.TOOL, self._line, self._tool))
        elif wanted is not None and self._customs.homes_whole:
            self._tool = wanted
            self._tell("T", "tools are not changed")

    def _set_modes(self, line: _Line) -> None:
        """Take in what holds from now on."""
        for code, index in line.g.items():
            if code in _PLANES:
                self._plane = _PLANES[code]
            elif code in (900, 910):
                self._absolute = code == 900
            elif code in (901, 911):
                self._absolute_centres = code == 901
            elif code in (980, 990):
                self._returns = code == 980
            elif code in (430, 490):
                self._set_tool_offset(line, code, index)
            elif f"G{code / 10:g}" in WORK_OFFSETS:
                self._offsets.select(f"G{code / 10:g}")
            elif code == 610:
                if self._customs.restores_at_61:
                    self._fail(index, "stored places are not understood: write the place instead")
                self._tolerance = 0.0
            elif code == 640:
                given = line.take("P")
                line.take("Q")
                if given is not None and given < 0.0:
                    self._fail(index, f"its tolerance P = {given:g} must be at least 0")
                least = self._settings.tolerance if given is None else given * self._unit
                if least > FAR:
                    self._fail(index, f"its tolerance {least:g} m must be at most {FAR:g} m")
                self._tolerance = least

    def _set_tool_offset(self, line: _Line, code: int, index: int) -> None:
        tool = 0
        if code == 430:
            given = line.whole("H")
            tool = self._tool if given is None else given
        if tool and tool not in self._settings.tools:
            reason = f"no offset of tool {tool} is known: name it in the settings under tools"
            self._fail(index, reason)
        tools = self._settings.tools
        self._offsets.set_tool(tools.get(tool, NOWHERE) if code == 430 else NOWHERE)

    def _do_once(self, line: _Line) -> bool:
        """Carry out what holds for this line alone; return whether it takes the axes."""
        for code, index in line.g.items():
            if code == 40:
                self._dwell(line, index)
            elif code == 100:
                self._set_work_offset(line, index)
            elif code == 280:
                self._go_home(line, index)
            elif code in (920, 921, 922, 923):
                self._set_off_position(line, code, index)
            if code in (100, 280, 920):
                return True
        return False

    def _dwell(self, line: _Line, index: int) -> None:
        duration = line.take("P")
        if duration is not None:
            duration *= self._customs.dwell_unit
        elif self._customs.homes_whole:
            duration = line.take("S")
        if duration is None or not duration >= 0.0:
            self._fail(index, "it needs a time, which is at least 0")
        self._writer.rest(Dwell(duration, self._line))

    def _set_work_offset(self, line: _Line, index: int) -> None:
        kind, number = line.whole("L"), line.whole("P") or 0
        if kind not in (2, 20) or number > len(WORK_OFFSETS):
            self._fail(index, f"only L2 and L20 with P0 to P{len(WORK_OFFSETS)} are understood")
        name = WORK_OFFSETS[number - 1] if number else self._offsets.work
        told = {axis: line.take(letter) for axis, letter in enumerate(AXES)}
        values = {axis: value * self._unit for axis, value in told.items() if value is not None}
        self._offsets.set_work(name, values, self._here if kind == 20 else None)

    def _set_off_position(self, line: _Line, code: int, index: int) -> None:
        if code == 920:
            named = [axis for axis in range(3) if line.index(AXES[axis]) >= 0]
            if line.index("E") >= 0 and not named:
                return
            if not named and not self._customs.resets_without_axes:
                self._fail(index, "it needs X, Y or Z: what the present place is to be called")
            values = {
                axis: (line.take(AXES[axis]) or 0.0) * self._unit for axis in named or range(3)
            }
            self._offsets.call(values, self._here)
        elif code == 923:
            self._offsets.call_again()
        else:
            self._offsets.call_no_more(for_good=code == 921)

    def _go_home(self, line: _Line, index: int) -> None:
        home = self._settings.home
        if home is None:
            self._fail(index, "no such place is known: name it in the settings as home")
        self._motors_off, self._most = 0, MOST_SEGMENTS
        named = [axis for axis in range(3) if line.index(AXES[axis]) >= 0]
        if self._customs.homes_whole:
            for letter in "XYZWOL":
                line.drop(letter)
            self._here[:] = home
            self._offsets.call_no_more(for_good=False)
        else:
            self._take_target(line, self._offsets.shift)
            self._go(at_full_speed=True)
            for axis in named or range(3):
                self._here[axis] = home[axis]
        self._go(at_full_speed=True)
        if self._customs.homes_whole:
            self._writer.finish()

    # Motion

    def _move(self, line: _Line, axes_are_taken: bool) -> None:
        """Carry out the motion of a line, if it has one."""
        motions = (0, 10, 20, 30, 800, *CYCLES)
        said = next((code for code in motions if code in line.g), None)
        if said is not None:
            if said in CYCLES and self._motion not in CYCLES:
                self._above = self._here[2]
            if said != self._motion:
                self._drilled = {}
            self._motion = None if said == 800 else said
            if axes_are_taken:
                self._fail(line.g[said], "another command takes the axes: write it on its own line")
        indices = [line.index(letter) for letter in AXES if line.index(letter) >= 0]
        is_arc = self._motion in (20, 30)
        if is_arc:
            is_arc = any(line.index(letter) >= 0 for letter in OFFSETS + "R")
        if axes_are_taken or not (indices or is_arc):
            return
        if self._motion is None:
            self._fail(indices[0], "no G0 to G3 before it says how to go there")
        if self._motion in (20, 30):
            if 530 in line.g:
                self._fail(line.g[530], "it goes with G0 and G1 only")
            self._move_on_arc(line)
            return
        if self._motion in CYCLES:
            self._drill(line, self._motion)
            return
        is_machine = 530 in line.g
        absolute, self._absolute = self._absolute, self._absolute or is_machine
        self._take_target(line, NOWHERE if is_machine else self._offsets.shift)
        self._absolute = absolute
        rapid = self._motion == 0
        self._go(rapid, rapid and not self._customs.rapid_at_feed)

    def _drill(self, line: _Line, code: int) -> None:
        """Drill the holes of a line; what it does not say is as in the hole before."""
        index = next(line.index(letter) for letter in AXES if line.index(letter) >= 0)
        if 530 in line.g or self._plane != (0, 1, 2):
            self._fail(index, "drilling cycles are understood along Z only: with G17, without G53")
        for letter, unit in (
            *dict.fromkeys("RZQ", self._unit).items(),
            ("P", self._customs.dwell_unit),
        ):
            value = line.take(letter)
            if value is not None:
                self._drilled[letter] = value * unit
        count, number = line.whole("L"), self._drilled.get
        if "Z" not in self._drilled or "R" not in self._drilled:
            self._fail(index, "a drilling cycle needs Z, the bottom, and R, where it begins")
        if count is not None and count > MOST:
            self._fail(index, f"there may be {MOST} holes in a line at most")
        steps = {axis: line.take(AXES[axis]) for axis in (0, 1)}
        # All holes of a line begin and end at the same heights.
        below = self._offsets.shift[2] if self._absolute else self._here[2]
        clear = below + self._drilled["R"]
        bottom = self._drilled["Z"] + (below if self._absolute else clear)
        try:
            cycle = Cycle(code, clear, bottom, number("Q"), number("P"))
        except NoHoleError as error:
            self._fail(index, str(error))
        for _ in range(1 if count is None else count):
            self._rise(max(clear, self._here[2]))
            for axis, value in steps.items():
                if value is not None:
                    before = self._offsets.shift[axis] if self._absolute else self._here[axis]
                    self._here[axis] = before + value * self._unit
            self._go(at_full_speed=not self._customs.rapid_at_feed)
            self._rise(clear)
            for stroke in cycle.strokes():
                self._rise(stroke.z, stroke.rapid)
                if stroke.rest:
                    self._writer.rest(Dwell(stroke.rest, self._line))
            self._rise(max(clear, self._above) if self._returns else clear)

    def _rise(self, z: float, rapid: bool = True) -> None:
        """Go straight up or down to a height [m]."""
        self._here[2] = z
        self._go(rapid, rapid and not self._customs.rapid_at_feed)

    def _take_target(self, line: _Line, shift: Sequence[float]) -> None:
        """Take in where the axes lead."""
        for axis, letter in enumerate(AXES):
            value = line.take(letter)
            if value is not None:
                before = shift[axis] if self._absolute else self._here[axis]
                self._here[axis] = before + value * self._unit

    def _go(self, rapid: bool = True, at_full_speed: bool = False) -> None:
        """Add the line to where the platform is sent, if it has a length."""
        if math.dist(self._here, self._writer.end) >= SHORTEST:
            self._add_line(rapid, at_full_speed)

    def _move_on_arc(self, line: _Line) -> None:
        p, q, along = self._plane
        words, start = _ArcWords(line, self._plane), tuple(self._here)
        self._take_target(line, self._offsets.shift)
        end = tuple(self._here)
        ends = ((start[p], start[q]), (end[p], end[q]))
        zero = (self._offsets.shift[p], self._offsets.shift[q]) if self._absolute_centres else None
        centre, angle = words.arc(ends, self._unit, zero, self._motion == 20)
        angle = words.turned(angle, self._customs.turns_given)
        size = abs(angle) * math.dist(ends[0], centre)
        rise = end[along] - start[along]
        if math.hypot(size, rise) < SHORTEST:
            return
        if size < SHORTEST:
            self._go(rapid=False)
            return
        middle = [0.0, 0.0, 0.0]
        middle[p], middle[q], middle[along] = centre[0], centre[1], start[along]
        axis = [0.0, 0.0, 0.0]
        axis[along] = 1.0
        if not max(map(abs, (*middle, *end, rise))) < FAR:
            self._fail_far()
        numbers, kind = [*middle, *axis, angle], SegmentKind.ARC_ABOUT
        if rise:
            numbers.append(rise)
            kind = SegmentKind.HELIX_ABOUT
        if self._writer.count >= self._most:
            self._begin_another_path()
        self._writer.add(kind, numbers, end, (self._tolerance, self._speed()), self._line, False)

    def _stop(self, line: _Line) -> None:
        for code in line.m:
            if code in _PAUSES and (code != 10 or self._settings.optional_stop):
                self._writer.rest(ProgramStop(_PAUSES[code], self._line))
            elif code in _ENDS:
                self._outputs.go_off(self._line)
                self._writer.rest(ProgramStop(StopKind.END, self._line))
                self._ended = True


# Codes are ten times their numbers: G17, G18 and G19 with the axes of a plane and the third axis;
# M3, M4 and M5 with the direction of the spindle; M62 to M65 with the value of the output.
_PLANES = {170: (0, 1, 2), 180: (2, 0, 1), 190: (1, 2, 0)}
_SPINDLE = ((30, 1.0), (40, -1.0), (50, 0.0))
_DIGITAL = {620: 1.0, 630: 0.0, 640: 1.0, 650: 0.0}
_COOLANT = {
    70: (("mist", 1.0),),
    80: (("flood", 1.0),),
    90: (("mist", 0.0), ("flood", 0.0)),
}


class _Line:
    """The words of a line, each to be taken by whoever gives it a meaning.

    Attributes:
        g: index of each word G by its tenfold number.
        m: index of each word M by its tenfold number.
        fail: raises the error about the word with an index; negative for the whole line.
    """

    def __init__(
        self,
        letters: str,
        values: Sequence[float | None],
        fail: Callable[[int, str], NoReturn],
    ) -> None:
        self.g: dict[int, int] = {}
        self.m: dict[int, int] = {}
        self._words: dict[str, tuple[float | None, int]] = {}
        self.fail = fail
        for index, (letter, value) in enumerate(zip(letters, values)):
            if letter in "GM":
                self._add_command(letter, value, index)
            elif letter in self._words:
                # M110 sets the number of the line that it stands on.
                if letter == "N":
                    continue
                fail(index, f"{letter} stands twice on this line: make two lines of it")
            else:
                self._words[letter] = value, index

    def _add_command(self, letter: str, value: float | None, index: int) -> None:
        commands = self.g if letter == "G" else self.m
        code = -1 if value is None else round(10.0 * value)
        if value is None or abs(10.0 * value - code) > 1e-6 or code < 0:
            self.fail(index, "this is no number of a command")
        if code in commands:
            self.fail(index, "it stands twice on this line")
        commands[code] = index

    def check(
        self,
        commands: Mapping[int, int],
        letter: str,
        groups: Mapping[int, str],
        help_of: Callable[[str], str],
    ) -> None:
        """Check that all commands are known, and that no two contradict each other."""
        found: dict[str, int] = {}
        for code, index in commands.items():
            if code not in groups:
                known = _HELP if letter == "G" else _HELP_OF_M
                help_text = known.get(code) or help_of(f"{letter}{code / 10:g}")
                self.fail(index, f"this command is not understood: {help_text}")
            other = found.setdefault(groups[code], code)
            if other != code:
                name = f"{letter}{other / 10:g}"
                self.fail(index, f"it contradicts {name} on the same line: make two lines of it")

    def index(self, letter: str) -> int:
        """Return the index of a word that is not taken yet, -1 if there is none."""
        return self._words[letter][1] if letter in self._words else -1

    def take(self, letter: str) -> float | None:
        """Return the number of a word, which has a meaning then; None if there is none."""
        if letter not in self._words:
            return None
        value, index = self._words.pop(letter)
        if value is None:
            self.fail(index, f"{letter} has no number")
        return value

    def whole(self, letter: str) -> int | None:
        """Return the number of a word that is whole and not negative."""
        index = self.index(letter)
        value = self.take(letter)
        if value is None:
            return None
        if value < 0.0 or value != int(value):
            self.fail(index, "it must be a whole number, at least 0")
        return int(value)

    def drop(self, letter: str) -> bool:
        """Leave out a word, with or without a number; return whether it is there."""
        return self._words.pop(letter, None) is not None

    def finish(self) -> None:
        """Check that each word has had a meaning."""
        for letter, (value, index) in self._words.items():
            if value is None:
                self.fail(index, f"{letter} has no number")
            if letter in "ABCUVW":
                if value == 0.0:
                    # Where an axis stays, the tool does not turn.
                    continue
                self.fail(index, f"there is no axis {letter}: the platform only translates")
            self.fail(
                index, f"{letter} has no meaning on this line: take it away if it is not needed"
            )
