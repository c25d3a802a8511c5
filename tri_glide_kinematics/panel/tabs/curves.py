"""Curves of the last seconds: the sliders' motion, and the swing with the tab of its shaper."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray
from viser import GuiApi, GuiUplotHandle
from viser.uplot import Axis, Scale, Series

from tri_glide_kinematics.panel.inputs import OperatorsInput, OperatorsNumber, add_button
from tri_glide_kinematics.panel.link import TABLE, MachineFacts, SteadyTimes, SwingFeed
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.words import note
from tri_glide_kinematics.settings import NO_SHAPER, Values
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text

# Plots of the last seconds, redrawn a few times a second: the sliders' motion, and a swing.


class CurveLimits(NamedTuple):
    """Limits of the three sliders: heights [m], velocities [m/s] and accelerations [m/s^2]."""

    lower_heights: Vector3
    upper_heights: Vector3
    velocities: Vector3
    accelerations: Vector3


LATEST = 1.0  # s that a sample may come after newer ones


class Ring:
    """Numbers of the last seconds in bins of equal width; a bin without a sample holds NaN.

    Attributes:
        bins: whose order is known to the ring alone. Shape (..., n).
        ages: of the bins, oldest first. Shape (n,) [s].
    """

    def __init__(self, shape: tuple[int, ...], span: float, width: float) -> None:
        """Start without samples.

        Args:
            shape: of what a bin holds.
            span: of all bins [s].
            width: of each [s].
        """
        self._count, self._width = round(span / width), width
        self._newest: int | None = None
        self.bins = np.full((*shape, self._count), math.nan)
        self.ages = (np.arange(self._count) - (self._count - 1)) * width

    def place(self, time: float) -> int:
        """Return the index of the bin of a ``time`` [s] that is none of the future."""
        return math.floor(time / self._width) % self._count

    def places(self, times: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
        """Tell which ``times`` have a bin, and return the indices of these. Shape (m,) [s]."""
        numbers = np.floor(times / self._width).astype(np.intp)
        newest = 0 if self._newest is None else self._newest
        have = (newest - self._count < numbers) & (numbers <= newest)
        return have, numbers[have] % self._count

    def advance(self, time: float) -> None:
        """Let the bins up to ``time`` [s] be the newest ones, empty if nothing came in them.

        A clock that goes back starts all of them anew.
        """
        bin_now = math.floor(time / self._width)
        if self._newest is None or bin_now < self._newest - LATEST / self._width:
            self.bins[:] = math.nan
        elif bin_now < self._newest:
            return
        else:
            passed = min(bin_now - self._newest, self._count)
            self.bins[..., (bin_now - np.arange(passed)) % self._count] = math.nan
        self._newest = bin_now

    def values(self) -> FloatArray:
        """Return all bins, oldest first. Shape (..., n)."""
        first = 0 if self._newest is None else self._newest + 1
        return np.roll(self.bins, -first, axis=-1)


SPAN = 10.0  # s
BIN = 0.05  # s
SLIDERS = 3
HEIGHTS, VELOCITIES, ACCELERATIONS = QUANTITIES = range(3)


class History:
    """The motion of the sliders in the last seconds.

    A bin holds the newest height, and of velocities and accelerations that which is farthest from
    zero: what comes near a limit for a moment is never lost.
    """

    def __init__(self) -> None:
        """Start without samples."""
        self._ring = Ring((len(QUANTITIES), SLIDERS), SPAN, BIN)
        self.advance, self.ages = self._ring.advance, self._ring.ages
        self._last: tuple[float, object] = -math.inf, None

    def add(
        self,
        time: float,
        heights: Sequence[float],
        velocities: Sequence[float],
        accelerations: Sequence[float],
    ) -> None:
        """Take in a sample, a little late at most; a clock that goes back starts the history anew.

        Between two equal samples nothing has moved: if the second is late, there is no hole.

        Args:
            time: of a steady clock [s].
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].
            accelerations: Shape (3,) [m/s^2].
        """
        sample = [tuple(each) for each in (heights, velocities, accelerations)]
        then, last = self._last
        self._last = time, sample
        is_late = sample == last and BIN < time - then < LATEST
        for moment in (*(np.arange(then + BIN, time, BIN) if is_late else ()), time):
            self.advance(moment)
            bins = self._ring.bins[..., self._ring.place(moment)]
            bins[HEIGHTS] = heights
            for quantity, new in ((VELOCITIES, velocities), (ACCELERATIONS, accelerations)):
                # A bin without a sample, which is NaN, keeps nothing.
                keep = np.abs(bins[quantity]) >= np.abs(new)
                bins[quantity] = np.where(keep, bins[quantity], new)

    def values(self, quantity: int) -> FloatArray:
        """Return one quantity of all sliders, oldest first. Shape (3, n)."""
        return self._ring.values()[quantity]


SWING_SPAN = 4.0  # s
# A swing of 60 Hz, which is a fast one, has four of them in a period [s].
SWING_BIN = 0.004
AXES = 3


class SwingHistory:
    """What an accelerometer has told in the last seconds, without its constant part.

    A bin holds the lowest and the highest acceleration: of more samples than bins no peak is lost.
    """

    def __init__(self) -> None:
        """Start without samples."""
        self._ring = Ring((2, AXES), SWING_SPAN, SWING_BIN)
        self.advance, self.ages = self._ring.advance, self._ring.ages

    def add(self, times: FloatArray, accelerations: FloatArray) -> None:
        """Take in samples; those that are not finite, or older than the history, are left out.

        Args:
            times: of a steady clock. Shape (m,) [s].
            accelerations: Shape (m, 3) [m/s^2].
        """
        finite = np.isfinite(accelerations).all(axis=1)
        times, accelerations = times[finite], accelerations[finite]
        if not times.size:
            return
        self.advance(float(times.max()))
        have, places = self._ring.places(times)
        for extremes, farther in zip(self._ring.bins, (np.fmin, np.fmax)):
            for extreme, told in zip(extremes, accelerations[have].T):
                farther.at(extreme, places, told)

    def values(self) -> FloatArray:
        """Return the accelerations, oldest first. Shape (3, n) [m/s^2].

        The constant part of an axis, which is gravity and the error of the sensor, is the median:
        that of a machine that rests for half of the time is what it feels at rest.
        """
        lowest, highest = self._ring.values()
        for axis in range(AXES):
            is_known = np.isfinite(lowest[axis])
            if is_known.any():
                constant = np.median((0.5 * lowest[axis] + 0.5 * highest[axis])[is_known])
                lowest[axis] -= constant
                highest[axis] -= constant
        return np.where(np.abs(lowest) > np.abs(highest), lowest, highest)


REDRAWN_AFTER = 0.25  # s
# Of a plot without its title, and of the numbers beside and below it [pixels].
PLOT_HEIGHT = 120
AXIS_WIDTH, AXIS_HEIGHT = 56, 26
MARGIN = 0.06  # of the range between the limits, beyond them
# Each has a contrast of at least 3 on a light and on a dark page.
COLOURS = ("#2b87d1", "#b87a00", "#00966c")
LIMIT_COLOUR = "#d9463c"


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


def _legend(names: Sequence[str], colours: Sequence[str]) -> str:
    return "".join(
        '<span style="padding-left:1em;white-space:nowrap">'
        f'<span style="color:{colour}">\u25a0</span> {name}</span>'
        for name, colour in zip(names, colours)
    )


def _series(names: Sequence[str], width: float) -> Iterable[Series]:
    return (Series(label=name, stroke=each, width=width) for name, each in zip(names, COLOURS))


def _add_plot(
    gui: GuiApi,
    title: str,
    columns: tuple[FloatArray, ...],
    series: Iterable[Series],
    scale: tuple[float, float],
    span: float,
    order: float | None = None,
) -> GuiUplotHandle:
    """Add a plot of ``columns``, of which the first has ages [s], to the open container.

    The ``scale`` is the range of all others, the ``span`` that of the ages [s].
    """
    return gui.add_uplot(
        columns,
        (Series(label="s"), *series),
        title=title,
        scales=_scales(scale, span),
        axes=(Axis(size=AXIS_HEIGHT), Axis(size=AXIS_WIDTH)),
        legend={"show": False},
        height=PLOT_HEIGHT,
        # Room for the uppermost and the last number.
        padding=(8, 24, 0, 0),
        order=order,
    )


def _scales(scale: tuple[float, float], span: float) -> dict[str, Scale]:
    return {"x": {"time": False, "range": (-span, 0.0)}, "y": {"range": scale}}


def _send(plot: GuiUplotHandle, columns: tuple[FloatArray, ...]) -> None:
    """Draw ``columns``, unless the ``plot`` has them: viser would send the same ones again."""
    pairs = zip(plot.data, columns)
    if not all(np.array_equal(old, new, equal_nan=True) for old, new in pairs):
        plot.data = columns


SLIDER_NAMES = tuple(f"slider {number}" for number in range(1, SLIDERS + 1))


class Curves:
    """Heights, velocities and accelerations of the last 10 s.

    All calls come from one thread.

    Attributes:
        plots: of heights, velocities and accelerations.
        history: takes in samples, at any rate.
        recorded: drawn in place of the last 10 s; None for these.
    """

    def __init__(self, gui: GuiApi, limits: CurveLimits) -> None:
        """Add the plots to the container of ``gui`` that is open."""
        self._gui = gui
        self.history = History()
        self._limits = limits
        self.recorded: History | None = None
        self._pace = Pace(REDRAWN_AFTER)
        gui.add_html(_legend((*SLIDER_NAMES, "limit"), (*COLOURS, LIMIT_COLOUR)))
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

    def draw(self, time: float) -> None:
        """Draw if it is time to, and let the curves go on to ``time`` [s] if no samples come."""
        if not self._pace.is_due(time):
            return
        self.history.advance(time)
        for plot, handle in zip(_PLOTS, self.plots):
            _send(handle, self._columns(plot))

    def _columns(self, plot: _Plot) -> tuple[FloatArray, ...]:
        """Return ages, curves and limits as columns of equal length."""
        ages = self.history.ages
        curves = (self.recorded or self.history).values(plot.quantity) * plot.scale
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
        lines = (Series(label="limit", stroke=LIMIT_COLOUR, dash=(6, 4)) for _ in limits)
        # The range is fixed: how near a curve is to its limits is seen at a glance.
        scale = (limits[0] - margin, limits[-1] + margin)
        columns = self._columns(plot)
        series = (*_series(SLIDER_NAMES, 1.5), *lines)
        return _add_plot(self._gui, plot.title, columns, series, scale, SPAN, order)


LEAST_LAG = 0.1  # mm


class LagPlot:
    """How far measured heights were from commanded ones, hidden where nothing recorded is drawn."""

    def __init__(self, gui: GuiApi) -> None:
        """Add the plot to the open container of ``gui``."""
        columns, scale = (np.array((-SPAN, 0.0)), *np.zeros((SLIDERS, 2))), (-LEAST_LAG, LEAST_LAG)
        title, series = "Measured less commanded [mm]", _series(SLIDER_NAMES, 1.5)
        self._plot = _add_plot(gui, title, columns, series, scale, SPAN)
        self._plot.visible = False

    def show(self, lag: History | None) -> None:
        """Draw a ``lag`` [m], which stands where velocities do; None hides the plot."""
        self._plot.visible = lag is not None
        if lag is not None:
            curves: list[FloatArray] = [1000.0 * each for each in lag.values(VELOCITIES)]
            most = 1.1 * float(np.fmax(np.abs(curves), LEAST_LAG).max())
            self._plot.scales = _scales((-most, most), SPAN)
            self._plot.data = (np.asarray(lag.ages), *curves)


AXIS_NAMES = ("x", "y", "z")
# The range of the plot of a swing, above and below zero, is at least and at most so large [m/s^2].
LEAST_RANGE, MOST_RANGE = 0.5, 1e6
# A curve that is less than half a pixel from zero is drawn as a straight line [m/s^2].
LEAST_SEEN = LEAST_RANGE / PLOT_HEIGHT
FLAT = (np.array((-SWING_SPAN, 0.0)), *np.zeros((AXES, 2)))


class SwingCurves:
    """Accelerations of the platform in the last 4 s along three axes, hidden while none is told.

    All calls come from one thread.

    Attributes:
        plot: of them.
        history: takes in samples, at any rate.
    """

    def __init__(self, gui: GuiApi) -> None:
        """Add the plot to the open container of ``gui``."""
        self.history = SwingHistory()
        self._pace = Pace(REDRAWN_AFTER)
        self._range = math.nan
        self._legend = gui.add_html(_legend(AXIS_NAMES, COLOURS), visible=False)
        title = f"Acceleration [m/s²], last {SWING_SPAN:g} s"
        columns, scale = self._columns(), (-LEAST_RANGE, LEAST_RANGE)
        series = _series(AXIS_NAMES, 1.0)
        self.plot = _add_plot(gui, title, columns, series, scale, span=SWING_SPAN)
        self.plot.visible = False

    def draw(self, time: float) -> bool:
        """Draw if it is time to; return whether there is something to see."""
        if self._pace.is_due(time):
            self.history.advance(time)
            columns = self._columns()
            is_told = len(columns[0]) > 0
            if is_told:
                largest = float(np.abs(columns[1:]).max())
                self._fit(largest)
                _send(self.plot, columns if largest > LEAST_SEEN else FLAT)
            self._legend.visible = self.plot.visible = is_told
        return self.plot.visible

    def _columns(self) -> tuple[FloatArray, ...]:
        """Return ages and accelerations as columns of equal length, without empty bins.

        A sensor may tell less often than there are bins.
        """
        values = self.history.values()
        told = np.isfinite(values[0])
        return self.history.ages[told], *values[:, told]

    def _fit(self, largest: float) -> None:
        """Choose the range: a power of two, so that it changes seldom."""
        _, exponent = math.frexp(min(max(largest, LEAST_RANGE), MOST_RANGE))
        needed = math.ldexp(1.0, exponent)
        if needed != self._range:
            self._range = needed
            self.plot.scales = _scales((-needed, needed), SWING_SPAN)


# The tab with the measured swing of the platform, and the shaper that calms it.

SHAPERS = TABLE["shaper"].choices
NOT_HEARD = "no accelerometer is heard (imu/data_raw)"

# Frequency [Hz] and damping [%].
ShownMode = tuple[float, float]


class Shaping(NamedTuple):
    """A shaper and its modes as the page shows them.

    Attributes:
        shaper: its kind, as ``ik_node`` names it.
        modes: one or two; without damping there are zeros.
    """

    shaper: str
    modes: tuple[ShownMode, ...]

    @classmethod
    def of(cls, facts: MachineFacts) -> Shaping:
        """Return what ``ik_node`` was told last."""
        frequencies, dampings = (
            tuple(facts.values[name]) for name in ("mode_frequencies", "mode_dampings")
        )
        # One damping may be that of all modes.
        dampings = dampings * len(frequencies) if len(dampings) == 1 else dampings
        modes = ((each, _rounded(100.0 * damping)) for each, damping in zip(frequencies, dampings))
        return cls(str(facts.values["shaper"]), tuple(modes))

    @property
    def values(self) -> Values:
        """The values of the parameters of ``ik_node``."""
        return {
            "shaper": self.shaper,
            "mode_frequencies": [frequency for frequency, _ in self.modes],
            "mode_dampings": [_rounded(0.01 * damping) for _, damping in self.modes],
        }

    def text(self, *, waits: bool) -> str:
        """Return it in words; ``waits`` is whether it waits for the next rest."""
        modes = " and ".join(
            f"{number_text(frequency)} Hz, {number_text(damping)} %"
            for frequency, damping in self.modes
        )
        words = "no shaper" if self.shaper == NO_SHAPER else f"{self.shaper} for {modes}"
        return f"{'from the next rest on' if waits else 'in force'}: {words}"


class SwingTab:
    """The curve of the measured swing, and fields for the shaper."""

    def __init__(self, requests: OperatorRequests) -> None:
        """Add all to the open container of the page."""
        gui = requests.gui
        self._requests = requests
        self._times = SteadyTimes()
        self._shown: Shaping | None = None
        self._silence = gui.add_html(note(NOT_HEARD))
        self.curves = SwingCurves(gui)
        with gui.add_folder("Shaper"):
            self._shaper = OperatorsInput(requests, gui.add_dropdown("Kind", SHAPERS))
            self._modes = [
                [
                    OperatorsNumber(requests, f"{name} [{unit}]", number, least=0.0)
                    for unit, number in (("Hz", 15.0), ("% damping", 5.0))
                ]
                for name in ("Mode", "2nd")
            ]
            self._has_second = OperatorsInput(requests, gui.add_checkbox("A second mode", False))
            look = {"color": "blue", "icon": viser.Icon.WAVE_SINE}
            add_button(requests, "Set", self._set, **look)
            self._words = gui.add_html("")

    def show(self, facts: MachineFacts | None, *, waits: bool) -> None:
        """Show the shaper that the machine has; None is for no machine.

        ``waits`` is whether a new one waits for the next rest.
        """
        if facts is None:
            self._shown = None
            self._words.content = ""
            return
        shaping = Shaping.of(facts)
        # Typed numbers stay until the machine has others.
        if shaping != self._shown:
            self._shown = shaping
            self._shaper.set(shaping.shaper)
            self._has_second.set(len(shaping.modes) > 1)
            for fields, mode in zip(self._modes, shaping.modes):
                for field, number in zip(fields, mode):
                    field.set(number)
        self._words.content = note(shaping.text(waits=waits))

    def draw(self, feed: SwingFeed) -> None:
        """Show how the platform swings by now."""
        now, samples = time.monotonic(), feed.take()
        if len(samples):
            stamps = samples[:, 0]
            times = stamps + self._times.offset(float(stamps[-1]), now)
            self.curves.history.add(times, samples[:, 1:])
        self._silence.visible = not self.curves.draw(now)

    @property
    def wanted(self) -> Shaping:
        """The shaper that the fields show.

        Raises:
            WrongNumberError: if one of them shows no number.
        """
        modes = self._modes if self._has_second.value else self._modes[:1]
        shown = tuple((frequency.value, damping.value) for frequency, damping in modes)
        return Shaping(self._shaper.value, shown)

    def _set(self) -> None:
        """Ask for the shaper and all of its modes at once."""
        self._requests.link.set_parameters("shaper", self.wanted.values, self._take_answer)

    def _take_answer(self, is_set: bool) -> None:
        if not is_set:
            # The fields show again what the machine has.
            self._shown = None


def _rounded(value: float) -> float:
    """Return a number without the rounding error of another unit."""
    return round(value, 12)
