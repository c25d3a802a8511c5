"""The recordings of faults on the page: chosen, drawn in place of the last seconds, downloaded."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Thread

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.inputs import OperatorsInput, add_button
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.programs import send_file
from tri_glide_kinematics.panel.tabs.curves import Curves, History, LagPlot
from tri_glide_kinematics.panel.viser_parts import uuid_of
from tri_glide_kinematics.panel.words import FAULT, note
from tri_glide_kinematics.recordings import (
    RecordingError,
    fault_folder,
    fault_recordings,
    load_recording,
)

NOW = "the last 10 s"


class FaultCurves:
    """The choice of what is drawn on the tab *Curves*."""

    def __init__(self, requests: OperatorRequests) -> None:
        """Add it to the open container of the page."""
        gui = requests.gui
        self._requests = requests
        self._files: dict[str, Path] | None = None
        self._choice = gui.add_dropdown("Curves of", (NOW,))
        self._input = OperatorsInput(requests, self._choice, self._choose)
        label = "Download the recording"
        self._download = add_button(requests, label, self._send, visible=False)
        self._words = gui.add_html("")
        self._lag = LagPlot(gui)
        self._offsets = np.zeros(3)
        self._chosen = NOW
        # What a thread has read: the name, its words, motion and lag.
        self._read: deque[tuple[str, str, History | None, History | None]] = deque()

    def look(self) -> None:
        """Offer the recordings that there are, and tell of a new one."""
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
            shown = add_button(self._requests, "recording", show, visible=False)
            text = "the seconds before the fault are recorded"
            self._requests.history.add(FAULT, text, press=uuid_of(shown))
        self._choice.options = (NOW, *files)
        self._show(self._chosen if self._chosen in files else NOW)

    def draw(self, curves: Curves, facts: MachineFacts) -> None:
        """Let ``curves`` draw what is chosen, once it is read."""
        self._offsets = np.array(facts.values["height_offsets"])
        if not self._read:
            return
        name, words, motion, lag = self._read.popleft()
        if name != self._chosen:
            return
        curves.recorded = motion
        self._words.content = note(words) if words else ""
        self._download.visible = name != NOW
        self._lag.show(lag)

    def _show(self, name: str) -> None:
        self._input.set(name)
        self._choose(name)

    def _choose(self, name: str) -> None:
        if name == self._chosen:
            return
        self._chosen = name
        if file := (self._files or {}).get(name):
            Thread(target=self._load, args=(name, file), daemon=True).start()
        else:
            self._read.append((NOW, "", None, None))

    def _load(self, name: str, file: Path) -> None:
        motion, lag = History(), History()
        try:
            recording = load_recording(file, ())
            with file.open(encoding="utf-8") as stream:
                words = stream.readline().lstrip("# ").strip()
            velocities = recording.velocities
            if velocities is None or recording.measured is None:
                raise RecordingError(file, "", "has no velocities or no measured heights")
            heights = recording.heights + self._offsets
            apart = recording.measured - recording.heights
            accelerations = np.gradient(velocities, recording.stamps, axis=0)
            for time, *numbers, lags in zip(
                recording.stamps.tolist(), heights, velocities, accelerations, apart
            ):
                motion.add(time, *numbers)
                lag.add(time, lags, lags, lags)
        except (KinematicsError, OSError, ValueError) as error:
            words = f"not drawn: {error}"
        self._read.append((name, words, motion, lag))

    def _send(self) -> None:
        if file := (self._files or {}).get(self._chosen):
            send_file(self._requests, file)
