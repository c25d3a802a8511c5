"""The tab with the measured swing of the platform, and the shaper that calms it."""

from __future__ import annotations

import time
from typing import NamedTuple

import viser

from tri_glide_kinematics.panel.curves import SwingCurves
from tri_glide_kinematics.panel.machine import (
    TABLE,
    MachineFacts,
    OperatorRequests,
    OperatorsInput,
    SteadyTimes,
    SwingFeed,
)
from tri_glide_kinematics.panel.markup import note
from tri_glide_kinematics.settings import NO_SHAPER, Values
from tri_glide_kinematics.wording import number_text

SHAPERS = TABLE["shaper"].choices
NOT_HEARD = "no accelerometer is heard (imu/data_raw)"
# A field for a mode that the shaper does not have: frequency [Hz] and damping [%].
NO_MODE = (0.0, 0.0)

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

    def __init__(self, gui: viser.GuiApi, requests: OperatorRequests) -> None:
        """Add all to the open container of ``gui``."""
        self._requests = requests
        self._times = SteadyTimes()
        self._shown: Shaping | None = None
        self._silence = gui.add_html(note(NOT_HEARD))
        self.curves = SwingCurves(gui)
        with gui.add_folder("Shaper"):
            self._shaper = OperatorsInput(requests, gui.add_dropdown("Kind", SHAPERS))
            self._modes = [
                OperatorsInput(requests, gui.add_vector2(label, NO_MODE, step=0.01, hint=hint))
                for label, hint in (
                    ("Mode [Hz, %]", "frequency and damping of the swing"),
                    ("2nd [Hz, %]", "0 Hz: there is no second mode"),
                )
            ]
            button = gui.add_button("Set", color="blue", icon=viser.Icon.WAVE_SINE)
            button.on_click(requests.on(lambda _: self._set()))
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
            for field, mode in zip(self._modes, (*shaping.modes, NO_MODE)):
                field.set(mode)
        self._words.content = note(shaping.text(waits=waits))

    def draw(self, feed: SwingFeed) -> None:
        """Show how the platform swings by now."""
        now, samples = time.monotonic(), feed.take()
        if len(samples):
            stamps = samples[:, 0]
            self.curves.add(stamps + self._times.offset(float(stamps[-1]), now), samples[:, 1:])
        self._silence.visible = not self.curves.draw(now)

    def _set(self) -> None:
        """Ask for the shaper and all of its modes at once."""
        first, second = (mode.value for mode in self._modes)
        wanted = Shaping(self._shaper.value, (first, second) if second[0] else (first,))
        self._requests.link.set_parameters("shaper", wanted.values)


def _rounded(value: float) -> float:
    """Return a number without the rounding error of another unit."""
    return round(value, 12)
