"""The map: how well the machine works at each place of a level, as a coloured plane."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, floor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.calibration import Calibration, load_measurements
from tri_glide_kinematics.calibration.session import solved
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.operator_requests import (
    OperatorRequests,
)
from tri_glide_kinematics.panel.program_reading import Mark, mark_of
from tri_glide_kinematics.panel.words import legend, note
from tri_glide_kinematics.sizing import Maps, level_corners, maps
from tri_glide_kinematics.vectors import FloatArray, three
from tri_glide_kinematics.wording import number_text

NO_MAP = "none"
CALIBRATION = "calibration"

# Of a drive: step [µm], force [N], stiffness [N/mm].
USUAL_DRIVE = {"Step [µm]": 10.0, "Force [N]": 100.0, "Stiffness [N/mm]": 100.0}

# Places along each side of a map: all of them take some hundredths of a second.
PLACES = 101

# From bad to good, as people see them who do not see all colours, too (viridis).
COLORS = np.array(
    (
        *((68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141)),
        *((39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37)),
    )
)
OPACITY = 220
# Values that differ by no more than this part are the same but for rounding.
ALL_THE_SAME = 1e-9


class Quantity(NamedTuple):
    """What a map shows.

    Attributes:
        words: what it is.
        unit: on the page.
        more_is_better: whether large values are good ones.
        values: returns them, by the maps, the largest speed of the platform [m/s], and the step,
            force and stiffness of a drive in the units of the page.
    """

    words: str
    unit: str
    more_is_better: bool
    values: Callable[[Maps, float, tuple[float, float, float]], FloatArray]


QUANTITIES = {
    "condition number": Quantity(
        "condition number of the Jacobian", "", False, lambda found, *_: found.conditions
    ),
    "speed": Quantity(
        "speed that the platform reaches in every direction",
        "mm/s",
        True,
        lambda found, speed, _: 1e3 * np.minimum(found.speeds, speed),
    ),
    "force": Quantity(
        "force with which the platform can push in every direction, beside the weight",
        "N",
        True,
        lambda found, _, drive: drive[1] * found.forces,
    ),
    "resolution": Quantity(
        "step of the platform, if each slider is up to half a step beside its setpoint",
        "µm",
        False,
        # The maps are those of drives with a step of 1.
        lambda found, _, drive: drive[0] * found.resolutions,
    ),
    "stiffness": Quantity(
        "stiffness in the softest direction; arms and frame count as rigid",
        "N/mm",
        True,
        lambda found, _, drive: drive[2] * found.stiffnesses,
    ),
}
UNCERTAINTY = "uncertainty that the calibration leaves: standard deviation of the distance"


class Level(NamedTuple):
    """The places of a level, and what is known of them.

    Attributes:
        lower: corner of the rectangle. Shape (2,) [m].
        upper: opposite corner. Shape (2,) [m].
        places: row by row from the lower corner on. Shape (PLACES^2, 2) [m].
        found: maps at the places, for drives with a step of 1.
    """

    lower: FloatArray
    upper: FloatArray
    places: FloatArray
    found: Maps

    @classmethod
    def of(cls, facts: MachineFacts) -> Level:
        """Return that of a machine."""
        lower, upper = level_corners(facts.workspace)
        x, y = (np.linspace(lower[axis], upper[axis], PLACES) for axis in range(2))
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        velocities = facts.bounds.limits.velocity
        return cls(lower, upper, places, maps(facts.workspace, places, velocities, 1.0))

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest height of the platform [m]; NaN if it may be nowhere."""
        low, high = self.found.heights
        return span_of(low)[0], span_of(high)[1]

    def inside(self, height: float) -> NDArray[np.bool_]:
        """Return at which places the platform may be at this ``height`` [m]. Shape (n,)."""
        low, high = self.found.heights
        return np.asarray((low <= height) & (height <= high))


def colored(
    values: FloatArray, span: tuple[float, float], *, more_is_better: bool
) -> NDArray[np.uint8]:
    """Return the colours of ``values``, shape (n,), which lie in a ``span``.

    Returns:
        Red, green, blue and opacity; what is not finite cannot be seen. Shape (n, 4).
    """
    least, largest = span
    known = np.isfinite(values)
    part = np.ones(len(values))
    if largest - least > ALL_THE_SAME * abs(largest):
        part = (np.where(known, values, least) - least) / (largest - least)
        part = part if more_is_better else 1.0 - part
    stops = np.linspace(0.0, 1.0, len(COLORS))
    mixed = [np.interp(part, stops, color) for color in COLORS.T]
    return np.column_stack((*mixed, np.where(known, OPACITY, 0))).astype(np.uint8)


def span_of(values: FloatArray) -> tuple[float, float]:
    """Return the least and the largest of ``values`` that are finite; (NaN, NaN) for none."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)


class MachineMap:
    """A map of the machine in the scene, and the fields with which it is chosen."""

    def __init__(self, requests: OperatorRequests, measurements: Path | None) -> None:
        """Add the fields to the open container of the page.

        ``measurements`` are those of a calibration whose uncertainty can be shown.
        """
        gui = requests.gui
        self._scene = requests.server.scene
        self._facts: MachineFacts | None = None
        self._level: Level | None = None
        self._is_due = False
        self._is_drawn = False
        self._measurements = measurements
        self._mark: Mark = ()
        # Or why there is none.
        self._calibration: Calibration | str = ""
        kinds = (NO_MAP, *QUANTITIES, CALIBRATION)
        with gui.add_folder("Map"):
            show = gui.add_dropdown("Show", kinds)
            height = gui.add_slider("Height [mm]", min=0, max=1, step=1, initial_value=0)
            drive = gui.add_folder("Each drive")
            with drive:
                self._drive = [
                    requests.number(label, number, least=0.0, on_change=self._change)
                    for label, number in USUAL_DRIVE.items()
                ]
            self._legend = gui.add_html("")
        self._slider, self._fields = height, (height, drive)
        self._kind, self._height = (
            requests.field(handle, self._change) for handle in (show, height)
        )
        self._show_fields()

    def show_machine(self, facts: MachineFacts) -> None:
        """Show the map of this machine, as its limits are now."""
        self._facts, self._level = facts, None
        self._change()

    def draw(self) -> None:
        """Draw what was chosen, if that has changed."""
        if self._is_due and self._facts is not None:
            self._is_due = False
            self._show_fields()
            self._draw(self._facts)

    def _change(self, _: object = None) -> None:
        self._is_due = True

    def _show_fields(self) -> None:
        for field in self._fields:
            field.visible = self._kind.value != NO_MAP

    def _draw(self, facts: MachineFacts) -> None:
        kind = self._kind.value
        if kind == NO_MAP:
            self._clear("")
            return
        if self._level is None:
            self._level = Level.of(facts)
            self._fit_height(self._level)
        height = 0.001 * self._height.value
        inside = self._level.inside(height)
        drive = three(field.last for field in self._drive)
        if kind == CALIBRATION:
            calibration = self._newest_calibration()
            if isinstance(calibration, str):
                self._clear(note(calibration))
                return
            words, unit, more_is_better = UNCERTAINTY, "µm", False
            values = np.full(len(inside), np.nan)
            places = np.column_stack((self._level.places, np.full(len(inside), height)))
            values[inside] = 1e6 * np.linalg.norm(
                calibration.position_uncertainties(places[inside]), axis=1
            )
            of_all = None
        else:
            words, unit, more_is_better, function = QUANTITIES[kind]
            values = function(self._level.found, facts.bounds.limits.platform_speed, drive)
            of_all = span_of(values)
            values = np.where(inside, values, np.nan)
        here = span_of(values)
        if not np.isfinite(here).all():
            self._clear(note("the platform cannot be at this height"))
            return
        span = of_all or here
        colors = colored(values, span, more_is_better=more_is_better)
        lower, upper = self._level.lower, self._level.upper
        width, depth = ((upper - lower) * PLACES / (PLACES - 1)).tolist()
        x, y = (0.5 * (lower + upper)).tolist()
        self._scene.add_image(
            "/map",
            # An image of viser has its first row at the least y.
            colors.reshape(PLACES, PLACES, 4),
            width,
            depth,
            cast_shadow=False,
            receive_shadow=False,
            position=(x, y, height),
        )
        self._is_drawn = True
        texts = [f"{number_text(value, 4)} {unit}".strip() for value in (*span, *here)]
        at_height = f"at this height {texts[2]} to {texts[3]}" if of_all else ""
        self._legend.content = legend(
            COLORS.tolist() if more_is_better else COLORS[::-1].tolist(), texts[0], texts[1]
        ) + note("; ".join(filter(None, (words, at_height))))

    def _fit_height(self, level: Level) -> None:
        """Let the slider have the heights of the workspace."""
        ends = level.ends
        if not np.isfinite(ends).all():
            return
        lowest, highest = ceil(1000.0 * ends[0]), floor(1000.0 * ends[1])
        self._slider.min, self._slider.max = lowest, max(highest, lowest + 1)
        if not lowest <= self._height.value <= highest or not self._is_drawn:
            self._height.set((lowest + highest) // 2)

    def _newest_calibration(self) -> Calibration | str:
        """Return the calibration of the file as it is now, or why there is none."""
        file = self._measurements
        if file is None:
            return "measurements_file names no measurements"
        mark = mark_of(file)
        if not mark or mark != self._mark:
            self._mark = mark
            try:
                self._calibration = solved(load_measurements(file))
            except KinematicsError as error:
                self._calibration = str(error)
        return self._calibration

    def _clear(self, words: str) -> None:
        """Show no map, but ``words``."""
        self._legend.content = words
        if self._is_drawn:
            self._is_drawn = False
            self._scene.remove_by_name("/map")
