"""Three plots of the sliders' motion with their limits, redrawn a few times a second."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from viser import GuiApi, GuiUplotHandle
from viser.uplot import Axis, Series

from tri_glide_kinematics.vectors import FloatArray, Vector3


class CurveLimits(NamedTuple):
    """Limits of the three sliders: heights [m], velocities [m/s] and accelerations [m/s^2]."""

    lower_heights: Vector3
    upper_heights: Vector3
    velocities: Vector3
    accelerations: Vector3


SPAN = 10.0  # s
BIN = 0.05  # s
SLIDERS = 3
HEIGHTS, VELOCITIES, ACCELERATIONS = QUANTITIES = range(3)
LATEST = 1.0  # s that a sample may come after newer ones


class History:
    """A ring of bins.

    A bin holds the newest height, and of velocities and accelerations that which is farthest from
    zero: what comes near a limit for a moment is never lost. A bin without a sample holds NaN.
    """

    def __init__(self) -> None:
        """Start without samples."""
        self._count = round(SPAN / BIN)
        self._bins = np.full((len(QUANTITIES), SLIDERS, self._count), math.nan)
        self._newest: int | None = None
        self.ages = (np.arange(self._count) - (self._count - 1)) * BIN

    def add(
        self,
        time: float,
        heights: Sequence[float],
        velocities: Sequence[float],
        accelerations: Sequence[float],
    ) -> None:
        """Take in a sample, a little late at most; a clock that goes back starts the history anew.

        Args:
            time: of a steady clock [s].
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].
            accelerations: Shape (3,) [m/s^2].
        """
        self.advance(time)
        place = math.floor(time / BIN) % self._count
        self._bins[HEIGHTS, :, place] = heights
        for quantity, new in ((VELOCITIES, velocities), (ACCELERATIONS, accelerations)):
            bins = self._bins[quantity, :, place]
            # A bin without a sample, which is NaN, keeps nothing.
            keep = np.abs(bins) >= np.abs(new)
            self._bins[quantity, :, place] = np.where(keep, bins, new)

    def advance(self, time: float) -> None:
        """Let the bins up to ``time`` [s] be the newest ones, empty if nothing came in them."""
        bin_now = math.floor(time / BIN)
        if self._newest is None or bin_now < self._newest - LATEST / BIN:
            self._bins[:] = math.nan
        elif bin_now < self._newest:
            return
        else:
            passed = min(bin_now - self._newest, self._count)
            self._bins[:, :, (bin_now - np.arange(passed)) % self._count] = math.nan
        self._newest = bin_now

    def values(self, quantity: int) -> FloatArray:
        """Return one quantity of all sliders, oldest first. Shape (3, n)."""
        if self._newest is None:
            return self._bins[quantity].copy()
        return np.roll(self._bins[quantity], -(self._newest + 1), axis=1)


REDRAWN_AFTER = 0.25  # s
# Of a plot without its title, and of the numbers beside and below it [pixels].
PLOT_HEIGHT = 120
AXIS_WIDTH, AXIS_HEIGHT = 56, 26
MARGIN = 0.06  # of the range between the limits, beyond them
SLIDER_COLOURS = ("#0072b2", "#e69f00", "#009e73")
LIMIT_COLOUR = "#a00000"


@dataclass(frozen=True)
class _Plot:
    """One plot: which quantity, its unit, and how many of this unit make one SI unit."""

    quantity: int
    title: str
    scale: float


_PLOTS = (
    _Plot(HEIGHTS, "Heights [mm], last 10 s", 1000.0),
    _Plot(VELOCITIES, "Velocities [mm/s]", 1000.0),
    _Plot(ACCELERATIONS, "Accelerations [m/s²]", 1.0),
)

_LEGEND = "".join(
    f'<span style="color:{colour};padding-left:1em;white-space:nowrap">\u25a0 {name}</span>'
    for name, colour in (
        *((f"slider {number}", colour) for number, colour in enumerate(SLIDER_COLOURS, start=1)),
        ("limit", LIMIT_COLOUR),
    )
)


class Curves:
    """Heights, velocities and accelerations of the last 10 s.

    All calls come from one thread.

    Attributes:
        plots: of heights, velocities and accelerations.
    """

    def __init__(self, gui: GuiApi, limits: CurveLimits) -> None:
        """Add the plots to the container of ``gui`` that is open."""
        self._gui = gui
        self._history = History()
        self._limits = limits
        self._drawn_at: float | None = None
        gui.add_html(_LEGEND)
        self.plots = [self._add(plot) for plot in _PLOTS]

    def set_limits(self, limits: CurveLimits) -> None:
        """Draw other limits from now on; called where the container is open again."""
        if limits == self._limits:
            return
        self._limits = limits
        for index, plot in enumerate(_PLOTS):
            order = self.plots[index].order
            self.plots[index].remove()
            self.plots[index] = self._add(plot, order)

    def add(
        self,
        time: float,
        heights: Sequence[float],
        velocities: Sequence[float],
        accelerations: Sequence[float],
    ) -> None:
        """Take in a sample, at any rate; arguments as for ``History.add``."""
        self._history.add(time, heights, velocities, accelerations)

    def draw(self, time: float) -> None:
        """Draw if it is time to, and let the curves go on to ``time`` [s] if no samples come."""
        if self._drawn_at is not None and 0.0 <= time - self._drawn_at < REDRAWN_AFTER:
            return
        self._drawn_at = time
        self._history.advance(time)
        for plot, handle in zip(_PLOTS, self.plots):
            handle.data = self._columns(plot)

    def _columns(self, plot: _Plot) -> tuple[FloatArray, ...]:
        """Return ages, curves and limits as columns of equal length."""
        ages = self._history.ages
        curves = self._history.values(plot.quantity) * plot.scale
        limits = (np.full(ages.size, limit) for limit in self._limits_of(plot))
        return ages, *curves, *limits

    def _limits_of(self, plot: _Plot) -> list[float]:
        """Return the limits in the unit of a plot, each once, ascending."""
        limits = self._limits
        if plot.quantity == HEIGHTS:
            ends = {*limits.lower_heights, *limits.upper_heights}
        else:
            largest = limits.velocities if plot.quantity == VELOCITIES else limits.accelerations
            ends = {*(-limit for limit in largest), *largest}
        return sorted(end * plot.scale for end in ends)

    def _add(self, plot: _Plot, order: float | None = None) -> GuiUplotHandle:
        limits = self._limits_of(plot)
        margin = MARGIN * (limits[-1] - limits[0])
        curves = (
            Series(label=f"slider {number}", stroke=colour, width=1.5)
            for number, colour in enumerate(SLIDER_COLOURS, start=1)
        )
        lines = (Series(label="limit", stroke=LIMIT_COLOUR, dash=(6, 4)) for _ in limits)
        return self._gui.add_uplot(
            self._columns(plot),
            (Series(label="s"), *curves, *lines),
            title=plot.title,
            # The range is fixed: how near a curve is to its limits is seen at a glance.
            scales={
                "x": {"time": False},
                "y": {"range": (limits[0] - margin, limits[-1] + margin)},
            },
            axes=(Axis(size=AXIS_HEIGHT), Axis(size=AXIS_WIDTH)),
            legend={"show": False},
            height=PLOT_HEIGHT,
            # Room for the uppermost and the last number.
            padding=(8, 24, 0, 0),
            order=order,
        )
