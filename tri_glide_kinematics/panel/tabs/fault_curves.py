"""The recordings of faults on the page: chosen, drawn in place of the last seconds, downloaded."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.operator_requests import (
    OperatorRequests,
)
from tri_glide_kinematics.panel.programs import send_file
from tri_glide_kinematics.panel.tabs.curves import BIN, RECORDED, SPAN, Curves, History
from tri_glide_kinematics.panel.viser_parts import uuid_of
from tri_glide_kinematics.panel.words import FAULT, note
from tri_glide_kinematics.recordings import (
    RecordingError,
    fault_folder,
    fault_recordings,
    load_recording,
)
from tri_glide_kinematics.vectors import Vector3

NOW = "the last 10 s"


class FaultCurves:
    """The choice of what is drawn on the tab *Curves*."""

    def __init__(self, requests: OperatorRequests) -> None:
        """Add it, and the curves below it, to the open container of the page."""
        gui = requests.gui
        self._requests = requests
        self._files: dict[str, Path] | None = None
        self._offsets: Vector3 = (0.0, 0.0, 0.0)
        self._choice = gui.add_dropdown("Curves of", (NOW,))
        self._input = requests.field(self._choice, self._choose)
        label = "Download the recording"
        self._download = requests.button(label, self._send, visible=False)
        self._words = gui.add_html("")
        self.curves = Curves(gui)
        self._chosen = NOW
        self._reader = ThreadPoolExecutor(1)
        self._reading: Future[tuple[History, str]] | None = None

    def look(self, offsets: Vector3) -> None:
        """Offer the recordings that there are, and tell of a new one.

        The ``offsets`` are what true heights have beyond reported ones. Shape (3,) [m].
        """
        self._offsets = offsets
        files: dict[str, Path] = {}
        with suppress(KinematicsError, OSError):
            namespace = self._requests.link.server.rpartition("/")[0]
            files = {file.stem: file for file in fault_recordings(fault_folder(namespace))}
        if files == self._files:
            return
        new = [] if self._files is None else [each for each in files if each not in self._files]
        self._files = files
        for name in reversed(new):
            show = partial(self._show, name)
            shown = self._requests.button("recording", show, visible=False)
            text = "the seconds before the fault are recorded"
            self._requests.history.add(FAULT, text, press=uuid_of(shown))
        self._choice.options = (NOW, *files)
        self._show(self._chosen if self._chosen in files else NOW)

    def step(self) -> None:
        """Have drawn what is chosen, once it is read."""
        if self._reading is not None and self._reading.done():
            self._take(*self._reading.result())

    def _show(self, name: str) -> None:
        self._input.set(name)
        self._choose(name)

    def _choose(self, name: str) -> None:
        if name == self._chosen:
            return
        self._chosen = name
        if file := (self._files or {}).get(name):
            self._reading = self._reader.submit(_read, file, self._offsets)
        else:
            self._take(None, "")

    def _take(self, recorded: History | None, words: str) -> None:
        self._reading, self.curves.recorded = None, recorded
        self._words.content = note(words) if words else ""
        self._download.visible = recorded is not None

    def _send(self) -> None:
        if file := (self._files or {}).get(self._chosen):
            send_file(self._requests, file)


def _read(file: Path, offsets: Vector3) -> tuple[History, str]:
    """Return what a recording has, and its words, or why it cannot be drawn."""
    history = History(RECORDED, SPAN, BIN)
    try:
        recording = load_recording(file, ())
        with file.open(encoding="utf-8") as stream:
            words = stream.readline().lstrip("# ").strip()
        velocities = recording.velocities
        if velocities is None or recording.measured is None:
            raise RecordingError(file, "", "has no velocities or no measured heights")
        heights, lag = recording.heights + offsets, recording.measured - recording.heights
        accelerations = np.gradient(velocities, recording.stamps, axis=0)
        history.add(recording.stamps, np.hstack((heights, velocities, accelerations, lag)))
    except (KinematicsError, OSError, ValueError) as error:
        words = f"not drawn: {error}"
    return history, words
