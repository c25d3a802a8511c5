"""The tab with the points that the operator has taught, which a file keeps as a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import viser
import yaml

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.panel.markup import note, table
from tri_glide_kinematics.panel.tabs.operator_requests import OperatorRequests, OperatorsInput
from tri_glide_kinematics.programs import PathStep, load_drive
from tri_glide_kinematics.vectors import Vector3

# Of a file that is written here: no other is overwritten.
FIRST_LINE = "# Points taught at the panel. Drive them: ros2 run tri_glide_kinematics drive FILE"

# Decimals of a millimetre in the file.
DIGITS = 4


class PointsFileError(KinematicsError):
    """A file of points cannot be written, or is none."""


def points_text(points: Sequence[Vector3], tolerance: float, speed: float) -> str:
    """Return a drive file with one path through the points, from where the platform is.

    Points and the ``tolerance`` at corners are in [m]; the ``speed`` is 0 for what the sliders can
    do [m/s].
    """
    bounds = f"{{tolerance: {_number(1000.0 * tolerance)}, speed: {_number(1000.0 * speed)}}}"
    rows = ",\n".join(f"  {{line: {{to: [{_in_millimetres(point)}]}}}}" for point in points)
    # In braces, so that a file that is cut off is no YAML.
    return (
        f"{FIRST_LINE}\n"
        f"{{unit: mm,\ndefaults: {bounds},\nsteps: [{{path: {{segments: [\n{rows}\n]}}}}]}}\n"
    )


def save_points(file: Path, points: Sequence[Vector3], tolerance: float, speed: float) -> None:
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


def load_points(file: Path) -> list[Vector3]:
    """Read the points of a drive file that holds one path of lines [m].

    Raises:
        DriveFileError: if it is no drive file.
        PointsFileError: if it holds something else than one path of lines.
    """
    steps = load_drive(file).steps
    if len(steps) != 1 or not isinstance(steps[0], PathStep) or steps[0].segments.kinds.any():
        raise PointsFileError(f"{file} holds more than one path of lines")
    rows = steps[0].segments.numbers.reshape(-1, 3).tolist()
    return [(x, y, z) for x, y, z in rows]


def _in_millimetres(point: Vector3) -> str:
    return ", ".join(_number(1000.0 * part) for part in point)


def _number(value: float) -> str:
    return str(yaml.safe_load(f"{round(value, DIGITS) + 0.0:f}"))


USUAL_TOLERANCE = 1.0  # mm

Follow = Callable[[list[Vector3], float, float], None]


class PointsTab:
    """Points that can be driven as a path, saved, and loaded again."""

    def __init__(
        self,
        gui: viser.GuiApi,
        requests: OperatorRequests,
        file: Path,
        present: Callable[[], Vector3 | None],
        follow: Follow,
    ) -> None:
        """Add all to the open container of ``gui``.

        The points are saved to a ``file`` and loaded from it; ``present`` returns where the
        platform is [m]; ``follow`` drives through points [m], within a tolerance [m], at a speed
        [m/s].
        """
        self.points: list[Vector3] = []
        self._requests = requests
        self._file = file
        self._present = present
        self._follow = follow
        gui.add_button("Teach this position", icon=viser.Icon.MAP_PIN_PLUS).on_click(
            requests.on(lambda _: self._teach())
        )
        self._table = gui.add_html("")
        self._edit = gui.add_button_group("Points", ("undo", "clear"))
        self._edit.on_click(requests.on(self._remove))
        self._tolerance = OperatorsInput(
            requests, gui.add_number("Corners [mm]", USUAL_TOLERANCE, min=0.0, step=0.1)
        )
        hint = "0: as fast as the sliders can"
        self._speed = OperatorsInput(
            requests, gui.add_number("Speed [mm/s]", 0.0, min=0.0, step=1.0, hint=hint)
        )
        gui.add_button("Drive through them", color="blue", icon=viser.Icon.ROUTE).on_click(
            requests.on(lambda _: self._drive())
        )
        self._files = gui.add_button_group("File", ("save", "load"))
        self._files.on_click(
            requests.on(lambda value: self._save() if value == "save" else self._load())
        )
        self._note = gui.add_html("")
        self._show()

    def _teach(self) -> None:
        position = self._present()
        if position is None:
            self._requests.refuse("nothing taught: the position of the platform is not known")
            return
        self.points.append(position)
        self._show()

    def _remove(self, what: str) -> None:
        del self.points[-1 if what == "undo" else 0 :]
        self._show()

    def _drive(self) -> None:
        self._follow(self.points, *self._bounds())

    def _save(self) -> None:
        save_points(self._file, self.points, *self._bounds())
        self._say(f"{len(self.points)} points saved as {self._file}")

    def _load(self) -> None:
        self.points = load_points(self._file)
        self._show()
        self._say(f"{len(self.points)} points of {self._file}")

    def _bounds(self) -> tuple[float, float]:
        return 0.001 * self._tolerance.value, 0.001 * self._speed.value

    def _say(self, text: str) -> None:
        self._note.content = note(text)

    def _show(self) -> None:
        head = ("", "x", "y", "z [mm]") if self.points else ("no points yet",)
        rows: list[tuple[str, ...]] = [head]
        rows += [
            (str(number), *(f"{1000.0 * part:.2f}" for part in point))
            for number, point in enumerate(self.points, 1)
        ]
        self._table.content = table(rows)
