"""The tab with the points that the operator has taught, which a file keeps as a path."""

from __future__ import annotations

import json
import re
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import viser
import yaml

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.keys import load_yaml
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.operator_requests import OperatorRequests, SpeedFields
from tri_glide_kinematics.panel.words import note, table
from tri_glide_kinematics.programs import DriveFileError, PathStep, load_drive
from tri_glide_kinematics.vectors import Vector3, three

# Of a file that is written here: no other is overwritten.
FIRST_LINE = "# Points taught at the panel. Drive them: ros2 run tri_glide_kinematics drive FILE"

# Decimals of a millimetre in the file.
DIGITS = 4


class PointsFileError(KinematicsError):
    """A file of points cannot be written, or is none."""


class Point(NamedTuple):
    """A taught point.

    Attributes:
        position: of the platform. Shape (3,) [m].
        name: that the operator has given it; empty for none.
    """

    position: Vector3
    name: str = ""


def points_text(points: Sequence[Point], tolerance: float, speed: float) -> str:
    """Return a drive file with one path through the points, from where the platform is.

    The ``tolerance`` at corners is in [m]; the ``speed`` is 0 for what the sliders can do [m/s].
    """
    bounds = f"{{tolerance: {_number(1000.0 * tolerance)}, speed: {_number(1000.0 * speed)}}}"
    rows = ",\n".join(map(_row, points))
    # In braces, so that a file that is cut off is no YAML.
    return (
        f"{FIRST_LINE}\n"
        f"{{unit: mm,\ndefaults: {bounds},\nsteps: [{{path: {{segments: [\n{rows}\n]}}}}]}}\n"
    )


def save_points(file: Path, points: Sequence[Point], tolerance: float, speed: float) -> None:
    """Write the points as a drive file; an older one is kept as ``NAME.bak``.

    Raises:
        PointsFileError: if there is no point, or the file cannot be written.
    """
    if not points:
        raise PointsFileError("there is no point to save, at least 1")
    try:
        replace_file(file, points_text(points, tolerance, speed))
    except OSError as error:
        raise PointsFileError(f"{file} cannot be written: {error.strerror or error}") from error


def load_points(file: Path) -> list[Point]:
    """Read the points of a drive file that holds one path of lines.

    Raises:
        DriveFileError: if it is no drive file.
        PointsFileError: if it holds something else than one path of lines.
    """
    match load_drive(file).steps:
        case (PathStep(segments=flat),) if not flat.kinds.any():
            places = flat.numbers.reshape(-1, 3).tolist()
        case _:
            raise PointsFileError(f"{file} holds more than one path of lines")
    # Of a file that was just read, and is what it should be.
    segments = load_yaml(file, DriveFileError)["steps"][0]["path"]["segments"]
    names = [segment["line"].get("name", "") for segment in segments]
    return [Point((x, y, z), name) for (x, y, z), name in zip(places, names)]


def is_points(file: Path) -> bool:
    """Tell whether a file was written here."""
    try:
        with file.open(encoding="utf-8", errors="replace") as stream:
            return stream.readline().rstrip() == FIRST_LINE
    except OSError:
        return False


def _row(point: Point) -> str:
    # JSON is YAML, whatever the name is.
    name = f", name: {json.dumps(point.name)}" if point.name else ""
    return f"  {{line: {{to: [{_in_millimetres(point.position)}]{name}}}}}"


def _in_millimetres(point: Vector3) -> str:
    return ", ".join(_number(1000.0 * part) for part in point)


def _number(value: float) -> str:
    return str(yaml.safe_load(f"{round(value, DIGITS) + 0.0:f}"))


USUAL_TOLERANCE = 1.0  # mm
# Number of changes that can be taken back; each keeps one list of points.
STEPS_BACK = 50
# A file of points in the folder; no path leads out of it.
FILE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_ -]{0,59}")
LONGEST_NAME = 30
NO_FILE = "choose a file"
SUFFIX = ".yaml"


class PointsTab:
    """Points that can be named, edited, gone to, driven as a path, saved, and loaded again.

    Attributes:
        points: in their order.
    """

    def __init__(
        self,
        requests: OperatorRequests,
        machine: ShownMachine,
        file: Path,
    ) -> None:
        """Add all to the open container of the page.

        The points of a ``machine`` are saved to a ``file``, or others beside it, and loaded from
        there.
        """
        gui = requests.gui
        self.points: tuple[Point, ...] = ()
        self._back: deque[tuple[Point, ...]] = deque(maxlen=STEPS_BACK)
        self._given = file
        self._folder = file.parent
        self._machine = machine
        button, buttons = requests.button, requests.buttons
        button("Teach this position", self._teach, icon=viser.Icon.MAP_PIN_PLUS)
        self._table = gui.add_html("")
        buttons("Points", {"undo": self._undo, "clear": self._ask})
        self._clear = button("Clear all points", self._clear_all, color="red", visible=False)
        self._keep = button("Keep them", self._keep_all, visible=False)
        with gui.add_folder("Point"):
            self._choice = requests.number(
                "Number",
                1,
                least=1,
                is_whole=True,
                on_change=lambda _: self._show_chosen(),
            )
            self._name = requests.field(gui.add_text("Name", ""))
            self._place = [requests.number(f"{axis} [mm]", 0.0) for axis in "xyz"]
            actions = {"go to": self._go, "change": self._change, "remove": self._remove}
            buttons("This one", actions)
        self._tolerance = requests.number("Corners [mm]", USUAL_TOLERANCE, least=0.0)
        self._speed = SpeedFields(requests, "Speed [mm/s]")
        button("Drive through them", self._drive, color="blue", icon=viser.Icon.ROUTE)
        self._file = requests.field(gui.add_text("File name", file.stem))
        self._saved = gui.add_dropdown("Files", [NO_FILE])
        self._saved_choice = requests.field(self._saved, self._choose_file)
        buttons("File", {"save": self._save, "load": self._load})
        self._note = gui.add_html("")
        self._show()
        self._list_files()

    def _put(self, points: Sequence[Point]) -> None:
        """Take other points; what was there before comes back by undo."""
        self._back.append(self.points)
        self.points = tuple(points)
        self._keep_all()
        self._show()

    def _teach(self) -> None:
        position = self._machine.measured_position
        if position is None:
            raise KinematicsError("nothing taught: the position of the platform is not known")
        self._put((*self.points, Point(position)))
        self._choice.set(len(self.points))
        self._show_chosen()

    def _undo(self) -> None:
        if not self._back:
            raise KinematicsError("nothing to undo")
        self.points = self._back.pop()
        self._keep_all()
        self._show()
        self._show_chosen()

    def _ask(self) -> None:
        """Ask before all are removed."""
        if self.points:
            self._clear.label = f"Clear all {len(self.points)} points"
            self._clear.visible = self._keep.visible = True

    def _clear_all(self) -> None:
        if self._clear.visible:
            self._put(())

    def _keep_all(self) -> None:
        self._clear.visible = self._keep.visible = False

    @property
    def _index(self) -> int:
        """Of the chosen point.

        Raises:
            KinematicsError: if there is none of this number.
        """
        index = int(self._choice.value) - 1
        if index not in range(len(self.points)):
            raise KinematicsError(f"there is no point {index + 1}, of {len(self.points)}")
        return index

    def _show_chosen(self) -> None:
        index = int(self._choice.last) - 1
        if index in range(len(self.points)):
            point = self.points[index]
            self._name.set(point.name)
            for field, part in zip(self._place, point.position):
                field.set(round(1000.0 * part, DIGITS) + 0.0)

    def _go(self) -> None:
        self._machine.move_to(self.points[self._index].position, self._bounds()[1])

    def _change(self) -> None:
        """Give the chosen point the name and the place in the fields."""
        index, name = self._index, self._name.value.strip()
        if len(name) > LONGEST_NAME or not name.isprintable():
            text = f"no name: {len(name)} characters, at most {LONGEST_NAME} that can be seen"
            raise KinematicsError(text)
        if name and name in (each.name for at, each in enumerate(self.points) if at != index):
            raise KinematicsError(f"another point has the name {name!r}")
        place = three(0.001 * field.value for field in self._place)
        self._put((*self.points[:index], Point(place, name), *self.points[index + 1 :]))

    def _remove(self) -> None:
        index = self._index
        self._put((*self.points[:index], *self.points[index + 1 :]))
        self._show_chosen()

    def _drive(self) -> None:
        if not self.points:
            raise KinematicsError("nothing to drive through: there are no points yet")
        self._machine.follow([point.position for point in self.points], *self._bounds())

    @property
    def _path(self) -> Path:
        """The chosen file.

        Raises:
            PointsFileError: if its name cannot be one.
        """
        name = self._file.value.strip().removesuffix(SUFFIX)
        if name == self._given.stem:
            return self._given
        if not FILE_NAME.fullmatch(name) or name == NO_FILE:
            raise PointsFileError(
                "no file: its name has to have 1 to 60 letters, digits, spaces, - and _, "
                f"and not to be {NO_FILE!r}"
            )
        return self._folder / f"{name}{SUFFIX}"

    def _save(self) -> None:
        file = self._path
        save_points(file, self.points, *self._bounds())
        self._say(f"{len(self.points)} points saved as {file}")
        self._list_files()

    def _load(self) -> None:
        file = self._path
        self._put(load_points(file))
        self._show_chosen()
        self._say(f"{len(self.points)} points of {file}")

    def _choose_file(self, name: str) -> None:
        if name != NO_FILE:
            self._file.set(name)

    def _list_files(self) -> None:
        """Offer the files of points that are in the folder."""
        files = [file for file in sorted(self._folder.glob(f"*{SUFFIX}")) if is_points(file)]
        names = [file.stem for file in files if file.stem.isprintable()]
        # A choice that is there twice ends the whole page.
        self._saved.options = [NO_FILE, *(name for name in names if name != NO_FILE)]
        self._saved_choice.set(NO_FILE)

    def _bounds(self) -> tuple[float, float]:
        return 0.001 * self._tolerance.value, self._speed.value

    def _say(self, text: str) -> None:
        self._note.content = note(text)

    def _show(self) -> None:
        head = ("", "x", "y", "z [mm]") if self.points else ("no points yet",)
        rows: list[tuple[str, ...]] = [head]
        rows += [
            (
                f"{number} {point.name}",
                *(f"{round(1000.0 * part, 2) + 0.0:.2f}" for part in point.position),
            )
            for number, point in enumerate(self.points, 1)
        ]
        self._table.content = table(rows)
