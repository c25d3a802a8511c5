"""Curves of the last seconds: the sliders' motion, and the swing with the tab of its shaper."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import viser
from viser import GuiApi
from viser.uplot import Axis, Scale, Series

from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.panel.link import TABLE, MachineFacts, SteadyTimes, SwingFeed
from tri_glide_kinematics.panel.operator_requests import (
    OperatorRequests,
)
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.words import note
from tri_glide_kinematics.settings import NO_SHAPER, Values
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

# Plots of the last seconds, redrawn a few times a second: the sliders' motion, and a swing.

LATEST = 1.0  # s that a sample may come after newer ones


class History:
    """The last seconds of some numbers, in bins of equal width.

    A bin holds the lowest and the highest of each number: however many samples there are, what
    comes near a limit for a moment is never lost. A bin without a sample holds NaN.

    Attributes:
        ages: of the bins, oldest first. Shape (n,) [s].
    """

    def __init__(self, numbers: int, span: float, width: float) -> None:
        """Start without samples.

        Args:
            numbers: of which a sample consists.
            span: of all bins [s].
            width: of each [s].
        """
        self._count, self._width = round(span / width), width
        self._newest: int | None = None
        self._bins = np.full((2, numbers, self._count), math.nan)
        self.ages = width * np.arange(1.0 - self._count, 1.0)

    def advance(self, time: float) -> None:
        """Let the bins up to ``time`` [s] be the newest ones, empty if nothing came in them.

        A clock that goes back starts all of them anew.
        """
        bin_now = math.floor(time / self._width)
        if self._newest is None or bin_now < self._newest - LATEST / self._width:
            self._bins[:] = math.nan
        elif bin_now < self._newest:
            return
        else:
            passed = min(bin_now - self._newest, self._count)
            self._bins[..., (bin_now - np.arange(passed)) % self._count] = math.nan
        self._newest = bin_now

    def add(self, times: FloatArray, samples: FloatArray) -> None:
        """Take in samples; those that are older than the history are left out.

        Args:
            times: of a steady clock. Shape (m,), at least one [s].
            samples: Shape (m, numbers); NaN for what is not known.
        """
        self.advance(float(times.max()))
        bins = np.floor(times / self._width).astype(np.intp)
        assert self._newest is not None
        have = np.flatnonzero((self._newest - self._count < bins) & (bins <= self._newest))
        if not have.size:
            return
        have = have[np.argsort(bins[have], kind="stable")]
        numbers = bins[have]
        starts = np.flatnonzero(np.append(True, numbers[1:] != numbers[:-1]))
        places = numbers[starts] % self._count
        for extremes, farther in zip(self._bins, (np.fmin, np.fmax)):
            told = farther.reduceat(samples[have], starts)
            extremes[:, places] = farther(extremes[:, places], told.T)

    @property
    def extremes(self) -> FloatArray:
        """The lowest numbers and the highest ones, oldest first. Shape (2, numbers, n)."""
        first = 0 if self._newest is None else self._newest + 1
        return np.roll(self._bins, -first, axis=-1)


def farthest(extremes: FloatArray) -> FloatArray:
    """Return those of the lowest and the highest numbers that are farthest from zero."""
    lowest, highest = extremes
    return np.where(np.abs(lowest) > np.abs(highest), lowest, highest)


REDRAWN_AFTER = 0.25  # s
# Of a plot without its title, and of the numbers beside and below it [pixels].
PLOT_HEIGHT = 120
AXIS_WIDTH, AXIS_HEIGHT = 56, 26
# Each has a contrast of at least 3 on a light and on a dark page.
COLOURS = ("#2b87d1", "#b87a00", "#00966c")
LIMIT_COLOUR = "#d9463c"


def _add_legend(gui: GuiApi, names: Sequence[str]) -> viser.GuiHtmlHandle:
    pairs = zip(names, (*COLOURS, LIMIT_COLOUR))
    content = "".join(
        '<span style="padding-left:1em;white-space:nowrap">'
        f'<span style="color:{colour}">\u25a0</span> {name}</span>'
        for name, colour in pairs
    )
    return gui.add_html(content, visible=False)


class Plot:
    """A plot of the last seconds, which is not seen before it is shown.

    Attributes:
        handle: of viser.
    """

    def __init__(
        self,
        gui: GuiApi,
        title: str,
        names: Sequence[str],
        span: float,
        *,
        width: float = 1.0,
        limits: int = 0,
    ) -> None:
        """Add it to the open container.

        Args:
            gui: of the page.
            title: over it.
            names: of its curves.
            span: of the ages [s].
            width: of a curve.
            limits: number of lines that show limits.
        """
        self._span, self._scale = span, (-1.0, 1.0)
        curves = (
            Series(label=name, stroke=each, width=width) for name, each in zip(names, COLOURS)
        )
        lines = limits * (Series(label="limit", stroke=LIMIT_COLOUR, dash=(6, 4)),)
        series = (Series(label="s"), *curves, *lines)
        self.handle = gui.add_uplot(
            (np.array((-span, 0.0)), *np.zeros((len(series) - 1, 2))),
            series,
            title=title,
            scales=self._scales,
            axes=(Axis(size=AXIS_HEIGHT), Axis(size=AXIS_WIDTH)),
            legend={"show": False},
            height=PLOT_HEIGHT,
            # Room for the uppermost and the last number.
            padding=(8, 24, 0, 0),
            visible=False,
        )

    def show(self, columns: Sequence[FloatArray], scale: tuple[float, float]) -> None:
        """Draw ``columns``, of which the first has ages [s]; ``scale`` is the range of the others.

        viser would send again what the page has already.
        """
        if scale != self._scale:
            self._scale = scale
            self.handle.scales = self._scales
        pairs = zip(self.handle.data, columns)
        if not all(np.array_equal(old, new, equal_nan=True) for old, new in pairs):
            self.handle.data = tuple(columns)
        self.handle.visible = True

    @property
    def _scales(self) -> dict[str, Scale]:
        ages = {"time": False, "range": (-self._span, 0.0)}
        return {"x": ages, "y": {"range": self._scale}}  # type: ignore[dict-item]


SPAN = 10.0  # s
BIN = 0.05  # s
SLIDERS = 3
SLIDER_NAMES = tuple(f"slider {number}" for number in range(1, SLIDERS + 1))
# Heights, velocities and accelerations: titles, and how many of their units make one of SI.
QUANTITIES = (
    ("Heights [mm], last 10 s", 1000.0),
    ("Velocities [mm/s]", 1000.0),
    ("Accelerations [m/s²]", 1.0),
)
MARGIN = 0.06  # of the range between the limits, beyond them
LEAST_LAG = 0.1  # mm
# Heights, velocities, accelerations, and measured less commanded heights of the sliders.
RECORDED = 4 * SLIDERS


def limits_of(facts: MachineFacts) -> FloatArray:
    """Return what bounds heights, velocities and accelerations. Shape (3, 6) [m, m/s, m/s^2]."""
    velocity, acceleration = (
        np.array(each) for each in (facts.limits.velocity, facts.limits.acceleration)
    )
    pairs = (facts.travel, (-velocity, velocity), (-acceleration, acceleration))
    return np.array([np.concatenate(pair) for pair in pairs])


class Curves:
    """Heights, velocities and accelerations of the last 10 s, or of a recording.

    All calls come from one thread.

    Attributes:
        plots: of heights, velocities and accelerations.
        lag: plot of how far measured heights were from commanded ones, of a recording only.
        recorded: drawn in place of the last 10 s; None for these.
    """

    def __init__(self, gui: GuiApi) -> None:
        """Add the plots to the open container of ``gui``; they are seen when they are drawn."""
        self.recorded: History | None = None
        self._history = History(len(QUANTITIES) * SLIDERS, SPAN, BIN)
        self._last: tuple[float, object] = -math.inf, None
        self._pace = Pace(REDRAWN_AFTER)
        self.lag = Plot(gui, "Measured less commanded [mm]", SLIDER_NAMES, SPAN, width=1.5)
        self._legend = _add_legend(gui, (*SLIDER_NAMES, "limit"))
        self.plots = [
            Plot(gui, title, SLIDER_NAMES, SPAN, width=1.5, limits=2 * SLIDERS)
            for title, _ in QUANTITIES
        ]

    def take(self, samples: Iterable[tuple[float, SliderState]]) -> None:
        """Take in samples with their times [s], a little late at most.

        A clock that goes back starts anew. Between two equal samples nothing has moved: if the
        second is late, there is no hole.
        """
        times: list[float] = []
        rows: list[SliderState] = []
        for moment, motion in samples:
            then, last = self._last
            self._last = moment, motion
            is_late = motion == last and moment - then < LATEST
            between = np.arange(then + BIN, moment, BIN).tolist() if is_late else []
            times += [*between, moment]
            rows += [motion] * (len(between) + 1)
        if times:
            self._history.add(np.array(times), np.array(rows).reshape(len(rows), -1))

    def draw(self, time: float, facts: MachineFacts) -> None:
        """Draw if it is time to, and let the curves go on to ``time`` [s] if no samples come.

        The limits are those of the ``facts``.
        """
        if not self._pace.is_due(time):
            return
        self._history.advance(time)
        history = self.recorded or self._history
        ages = history.ages
        quantities = farthest(history.extremes).reshape(-1, SLIDERS, len(ages))
        for plot, values, bounds, (_, scale) in zip(
            self.plots, quantities, limits_of(facts), QUANTITIES
        ):
            ends = scale * bounds
            margin = MARGIN * float(np.ptp(ends))
            lines = (np.full(len(ages), end) for end in ends)
            # The range is fixed: how near a curve is to its limits is seen at a glance.
            between = float(ends.min()) - margin, float(ends.max()) + margin
            plot.show((ages, *(scale * values), *lines), between)
        self._legend.visible = True
        if self.recorded is None:
            self.lag.handle.visible = False
        else:
            lag = 1000.0 * quantities[-1]
            most = 1.1 * float(np.fmax(np.abs(lag), LEAST_LAG).max())
            self.lag.show((ages, *lag), (-most, most))


SWING_SPAN = 4.0  # s
# A swing of 60 Hz, which is a fast one, has four of them in a period [s].
SWING_BIN = 0.004
AXIS_NAMES = ("x", "y", "z")
# The range of the plot of a swing, above and below zero, is at least and at most so large [m/s^2].
LEAST_RANGE, MOST_RANGE = 0.5, 1e6
# A curve that is less than half a pixel from zero is drawn as a straight line [m/s^2].
LEAST_SEEN = LEAST_RANGE / PLOT_HEIGHT
FLAT = (np.array((-SWING_SPAN, 0.0)), *np.zeros((len(AXIS_NAMES), 2)))


class SwingCurves:
    """Accelerations of the platform in the last 4 s along three axes, hidden while none is told.

    All calls come from one thread.

    Attributes:
        plot: of them.
    """

    def __init__(self, gui: GuiApi) -> None:
        """Add the plot to the open container of ``gui``."""
        self._history = History(len(AXIS_NAMES), SWING_SPAN, SWING_BIN)
        self._pace = Pace(REDRAWN_AFTER)
        self._legend = _add_legend(gui, AXIS_NAMES)
        title = f"Acceleration [m/s²], last {SWING_SPAN:g} s"
        self.plot = Plot(gui, title, AXIS_NAMES, SWING_SPAN)

    def take(self, times: FloatArray, accelerations: FloatArray) -> None:
        """Take in samples; those that are not finite are left out.

        Args:
            times: of a steady clock. Shape (m,) [s].
            accelerations: Shape (m, 3) [m/s^2].
        """
        finite = np.isfinite(accelerations).all(axis=1)
        if finite.any():
            self._history.add(times[finite], accelerations[finite])

    def draw(self, time: float) -> bool:
        """Draw if it is time to; return whether there is something to see."""
        if self._pace.is_due(time):
            self._history.advance(time)
            extremes = self._history.extremes
            # A sensor may tell less often than there are bins.
            told = np.isfinite(extremes[0, 0])
            self._legend.visible = self.plot.handle.visible = bool(told.any())
            if told.any():
                self._show(self._history.ages[told], extremes[..., told])
        return self.plot.handle.visible

    def _show(self, ages: FloatArray, extremes: FloatArray) -> None:
        # The constant part of an axis, which is gravity and the error of the sensor, is the median:
        # that of a machine that rests for half of the time is what it feels at rest.
        middle = 0.5 * extremes[0] + 0.5 * extremes[1]
        swing = farthest(extremes - np.median(middle, axis=1, keepdims=True))
        largest = float(np.abs(swing).max())
        # A power of two, so that the range changes seldom.
        _, exponent = math.frexp(min(max(largest, LEAST_RANGE), MOST_RANGE))
        most = math.ldexp(1.0, exponent)
        self.plot.show((ages, *swing) if largest > LEAST_SEEN else FLAT, (-most, most))


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
            self._shaper = requests.field(gui.add_dropdown("Kind", SHAPERS))
            self._modes = [
                [
                    requests.number(f"{name} [{unit}]", number, least=0.0)
                    for unit, number in (("Hz", 15.0), ("% damping", 5.0))
                ]
                for name in ("Mode", "2nd")
            ]
            self._has_second = requests.field(gui.add_checkbox("A second mode", False))
            look = {"color": "blue", "icon": viser.Icon.WAVE_SINE}
            requests.button("Set", self._set, **look)
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
            self.curves.take(times, samples[:, 1:])
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
