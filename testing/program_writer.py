"""Programs at random in each dialect of G-code, with what they mean, found without the reader."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from tri_glide_kinematics.programs import Dialect, ProgramSettings, StopKind
from tri_glide_kinematics.vectors import FloatArray

CENTRE = np.array((0.0, 0.0, 0.3))
SIZE = 0.05
MILLIMETRE, INCH = 1e-3, 25.4e-3
PRINTING = (Dialect.MARLIN, Dialect.REPRAP, Dialect.KLIPPER)
MILLING = (Dialect.NIST, Dialect.GRBL)

# Of each plane the two axes in it, and the one along its normal.
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}


class Piece(NamedTuple):
    """A line, or an arc or helix about a coordinate axis, as it is meant.

    Attributes:
        start: Shape (3,) [m].
        end: Shape (3,) [m].
        speed: infinite for none [m/s].
        tolerance: [m].
        plane: of an arc; 0 for a line.
        centre: of an arc. Shape (3,) [m].
        angle: right-handed about the axis of the plane [rad].
    """

    start: FloatArray
    end: FloatArray
    speed: float
    tolerance: float
    plane: int = 0
    centre: FloatArray = CENTRE
    angle: float = 0.0

    def at(self, parts: FloatArray) -> FloatArray:
        """Return the places at some parts of the whole, shape (n,). Shape (n, 3) [m]."""
        along = self.start + parts[:, np.newaxis] * (self.end - self.start)
        if not self.plane:
            return np.asarray(along)
        p, q, _ = PLANES[self.plane]
        x, y = self.start[p] - self.centre[p], self.start[q] - self.centre[q]
        sine, cosine = np.sin(self.angle * parts), np.cos(self.angle * parts)
        along[:, p] = self.centre[p] + cosine * x - sine * y
        along[:, q] = self.centre[q] + sine * x + cosine * y
        return np.asarray(along)


# A piece, a dwell [s], an output (name, number, value), why it stops; or None for rest alone.
Meant = Piece | float | tuple[str, int, float] | StopKind | None


@dataclass
class WrittenProgram:
    """A program and its meaning.

    Attributes:
        text: of the program.
        settings: with which it is to be read.
        meant: in its order.
        lines: number of the line of each.
    """

    text: bytes
    settings: ProgramSettings
    meant: list[Meant] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)


def written_program(rng: np.random.Generator, dialect: Dialect, count: int = 30) -> WrittenProgram:
    """Return a program of ``count`` things that it does."""
    return _Writer(rng, dialect).program(count)


class _Writer:
    """Writes one program; its places are those of the machine [m]."""

    def __init__(self, rng: np.random.Generator, dialect: Dialect) -> None:
        self._rng = rng
        self._dialect = dialect
        self._feed_time = 1.0 if dialect is Dialect.DELTA_X else 60.0
        self._end_of_line = self._choice("\n", "\r\n")
        self._spaced = self._chance(0.8)
        self._lower = self._chance(0.3)
        self._numbered = self._chance(0.4)
        self._checked = self._chance(0.5) and dialect in PRINTING
        offsets = {name: tuple(self._place() - CENTRE) for name in ("G54", "G55", "G59.3")}
        self._settings = ProgramSettings(
            dialect,
            start=tuple(self._place()),
            home=tuple(CENTRE),
            offsets=offsets,
            tools={3: (0.0, 0.0, 0.02)},
            tolerance=1e-4,
        )
        self._work = "G54"
        self._offsets = {name: np.array(offset) for name, offset in offsets.items()}
        self._set_off = np.zeros(3)
        self._tool = np.zeros(3)
        self._here = np.array(self._settings.start)
        self._unit = MILLIMETRE
        self._absolute, self._absolute_centres = True, False
        self._plane, self._motion = 17, -1
        self._tolerance = self._settings.tolerance
        self._feed = 0.0
        self._spindle = False
        self._texts: list[str] = []
        self._written = WrittenProgram(b"", self._settings)

    def program(self, count: int) -> WrittenProgram:
        if self._chance(0.3):
            self._texts.append("%" if self._dialect is Dialect.NIST else "; begin")
        changes = [self._change_units, self._change_distances, self._change_plane]
        changes += [self._change_offset, self._change_tolerance, self._say_nothing]
        acts = [self._line] * 4 + [self._arc] * 4 + [self._dwell, self._output, self._home]
        while len(self._written.meant) < count:
            if self._chance(0.3):
                changes[self._rng.integers(len(changes))]()
            else:
                acts[self._rng.integers(len(acts))]()
        self._end()
        text = self._end_of_line.join(self._texts) + self._end_of_line
        self._written.text = text.encode()
        return self._written

    # Chance

    def _chance(self, part: float) -> bool:
        return bool(self._rng.random() < part)

    def _choice(self, *choices: Any) -> Any:
        return choices[self._rng.integers(len(choices))]

    def _place(self) -> FloatArray:
        return np.asarray(CENTRE + self._rng.uniform(-SIZE, SIZE, 3))

    # Lines of text

    def _number(self, value: float) -> str:
        text = f"{value:.11f}"
        form = self._rng.integers(4)
        if form == 0:
            text = text.rstrip("0")
        elif form == 1 and value >= 0.0:
            text = "+" + text
        elif form == 2 and abs(value) < 1.0:
            text = text.replace("0.", ".", 1)
        return text

    def _write(self, *words: str) -> None:
        """Write a line; its words as they are, but for spaces and the size of letters."""
        between = self._choice(" ", "  ", "\t") if self._spaced else ""
        text = between.join(words)
        if self._lower:
            text = text.lower()
        if self._numbered or self._checked:
            text = f"N{len(self._texts) + 1}{between}{text}"
        if self._chance(0.1):
            text += " (a comment; of X1)"
        if self._checked:
            checksum = 0
            for code in text.encode():
                checksum ^= code
            text += f"*{checksum}"
        if self._chance(0.1):
            text += " ; a comment (of Y2"
        self._texts.append(text)

    def _mean(self, meant: Meant) -> None:
        """Take down what the line that is written next means."""
        self._written.meant.append(meant)
        self._written.lines.append(len(self._texts) + 1)

    # What holds

    def _change_units(self) -> None:
        self._unit = self._choice(MILLIMETRE, INCH)
        self._write("G21" if self._unit == MILLIMETRE else "G20")

    def _change_distances(self) -> None:
        self._absolute, self._absolute_centres = self._chance(0.6), self._chance(0.3)
        words = ["G90" if self._absolute else "G91"]
        words.append("G90.1" if self._absolute_centres else "G91.1")
        self._write(*(words if self._chance(0.5) else words[::-1]))

    def _change_plane(self) -> None:
        self._plane = self._choice(17, 18, 19)
        self._write(f"G{self._plane}")

    def _change_offset(self) -> None:
        kind = self._rng.integers(4)
        if kind == 0:
            self._work = self._choice(*self._offsets)
            self._write(self._work)
        elif kind == 1:
            values = self._rng.uniform(-20.0, 20.0, 3)
            self._write("G92", *(f"{axis}{value:.6f}" for axis, value in zip("XYZ", values)))
            values = np.round(values, 6) * self._unit
            self._set_off = self._here - self._offsets[self._work] - self._tool - values
        elif kind == 2:
            self._tool = np.array((0.0, 0.0, 0.02)) * self._choice(0.0, 1.0)
            self._write(*(("G43", "H3") if self._tool.any() else ("G49",)))
        else:
            self._set_off = np.zeros(3)
            self._write("G92.1")

    def _change_tolerance(self) -> None:
        if self._chance(0.3) and self._dialect is not Dialect.MARLIN:
            self._tolerance = 0.0
            self._write("G61")
        elif self._chance(0.5):
            self._tolerance = round(self._rng.uniform(0.001, 0.01), 5) * self._unit
            self._write("G64", f"P{self._tolerance / self._unit:.5f}")
        else:
            self._tolerance = self._settings.tolerance
            self._write("G64")

    def _say_nothing(self) -> None:
        lines = ["(nothing; at all)", "", ";X1 Y2", "/G1 X500", "  "]
        if self._dialect in PRINTING:
            lines += ["M117 Layer 3, (X1 of 20%", "M104 S200", "M82", "G92 E0", "M84 E"]
        if self._dialect is Dialect.KLIPPER:
            lines += ["EXCLUDE_OBJECT_START NAME=cube", "set_velocity_limit ACCEL=3000"]
        if self._dialect in MILLING:
            lines += ["G40 G80 G94", "M48"]
        if self._dialect is Dialect.GRBL:
            lines += ["$X", "$100=250 (steps)"]
        text = self._choice(*lines)
        if text.startswith("G40"):
            self._motion = -1
        self._texts.append(text)

    # What it does

    def _words_to(self, end: FloatArray) -> list[str]:
        """Return the words of the axes that lead to a place; some that do not change are left out.

        Of incremental ones the place is the sum.
        """
        shift = self._offsets[self._work] + self._set_off + self._tool
        before = shift if self._absolute else self._here
        words = []
        for axis, letter in enumerate("XYZ"):
            if end[axis] != self._here[axis] or self._chance(0.3):
                words.append(letter + self._number((end[axis] - before[axis]) / self._unit))
        return words

    def _command(self, motion: int) -> list[str]:
        """Return the word of a motion, which may be left out if it is that of the line before."""
        words = [] if motion == self._motion and self._chance(0.5) else [f"G{motion}"]
        if words and self._chance(0.2):
            words = [f"G0{motion}"]
        self._motion = motion
        return words

    def _speed_words(self) -> list[str]:
        if self._feed and self._chance(0.7):
            return []
        self._feed = round(self._rng.uniform(0.01, 0.2), 4)
        return ["F" + self._number(self._feed * self._feed_time / self._unit)]

    def _extrusion(self) -> list[str]:
        words = [f"E{self._rng.uniform(0.0, 5.0):.5f}"]
        return words if self._dialect in PRINTING and self._chance(0.5) else []

    def _line(self) -> None:
        end = self._place()
        for axis in range(3):
            if self._chance(0.3):
                end[axis] = self._here[axis]
        if np.array_equal(end, self._here):
            return
        rapid = self._chance(0.3)
        at_speed = not rapid or self._dialect not in MILLING
        words = self._command(0 if rapid else 1)
        axes = self._words_to(end)
        rest = (self._speed_words() if at_speed else []) + self._extrusion()
        speed = self._feed if at_speed else math.inf
        self._mean(Piece(self._here, end, speed, self._tolerance))
        self._write(*words, *self._shuffled(axes + rest))
        self._here = end

    def _shuffled(self, words: list[str]) -> list[str]:
        return [words[index] for index in self._rng.permutation(len(words))]

    def _arc(self) -> None:
        p, q, along = PLANES[self._plane]
        start, radius = self._here, self._rng.uniform(0.002, 0.03)
        first = self._rng.uniform(-math.pi, math.pi)
        whole = self._chance(0.15)
        size = 2.0 * math.pi if whole else self._rng.uniform(0.1, 2.0 * math.pi - 0.1)
        angle = math.copysign(size, self._rng.uniform(-1.0, 1.0))
        centre = start.copy()
        centre[p] -= radius * math.cos(first)
        centre[q] -= radius * math.sin(first)
        end = start.copy()
        if not whole:
            end[p] = centre[p] + radius * math.cos(first + angle)
            end[q] = centre[q] + radius * math.sin(first + angle)
        if self._chance(0.4):
            end[along] = self._place()[along]
        words = self._command(3 if angle > 0.0 else 2)
        axes = self._words_to(end)
        # What is written is exact near half a turn only with its centre.
        if not whole and abs(size - math.pi) > 0.1 and self._chance(0.4):
            axes.append("R" + self._number(math.copysign(radius, math.pi - size) / self._unit))
        else:
            shift = self._offsets[self._work] + self._set_off + self._tool
            before = shift if self._absolute_centres else start
            for axis in (p, q):
                value = (centre[axis] - before[axis]) / self._unit
                axes.append("IJK"[axis] + self._number(value))
        if whole and self._dialect is Dialect.NIST and self._chance(0.5):
            turns = int(self._rng.integers(1, 4))
            axes.append(f"P{turns}")
            angle *= turns
        axes += self._speed_words() + self._extrusion()
        self._mean(Piece(start, end, self._feed, self._tolerance, self._plane, centre, angle))
        self._write(*words, *self._shuffled(axes))
        self._here = end

    def _dwell(self) -> None:
        duration = round(self._rng.uniform(0.0, 2.0), 3)
        self._mean(duration)
        if self._dialect in MILLING:
            self._write("G4", f"P{duration:.3f}")
        elif self._chance(0.5) and self._dialect is not Dialect.KLIPPER:
            self._write("G4", f"S{duration:.3f}")
        else:
            self._write("G4", f"P{1e3 * duration:.0f}")

    def _output(self) -> None:
        kind = self._rng.integers(3)
        number, value = int(self._rng.integers(8)), float(self._rng.integers(1, 256))
        if kind == 0:
            self._mean(("pin", number, value))
            self._write("M42", f"P{number}", f"S{value:.0f}")
        elif kind == 1:
            is_on = self._chance(0.5)
            self._mean(("digital", number, float(is_on)))
            self._write(self._choice("M62", "M64") if is_on else "M65", f"P{number}")
        else:
            turn = self._choice(1.0, -1.0)
            self._mean(("spindle", 0, turn * value))
            self._write("M3" if turn > 0.0 else "M4", f"S{value:.0f}")
            self._spindle = True

    def _home(self) -> None:
        if np.array_equal(self._here, CENTRE):
            return
        self._mean(Piece(self._here, CENTRE, math.inf, self._tolerance))
        self._write("G28")
        self._here = CENTRE.copy()
        if self._dialect not in MILLING:
            self._set_off = np.zeros(3)
            self._mean(None)

    def _end(self) -> None:
        if self._spindle:
            self._mean(("spindle", 0, 0.0))
        self._mean(StopKind.END)
        self._write(self._choice("M2", "M30"))
        self._texts.append("anything [at all")
