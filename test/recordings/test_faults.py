"""What came before a fault is on the disk, the last five times, and can be judged."""

import threading
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from controller_rig import HOME, LIMITS, LOWER, MACHINE, PERIOD, TARGET, UPPER, Rig

from tri_glide_kinematics.control import FAULT, IDLE
from tri_glide_kinematics.recordings import (
    FaultRecorder,
    fault_folder,
    fault_recordings,
    judge,
    load_recording,
)
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

BEGUN = datetime(2026, 11, 29)
OFFSETS = (0.01, -0.02, 0.03)
PLACES = (TARGET, (0.0, 0.0, 0.35))


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


class RecordedRig(Rig):
    """A controller whose faults are recorded."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[str] = []
        self.warned: list[str] = []
        offsets = (OFFSETS[0], OFFSETS[1], OFFSETS[2])
        tell, warn = self.told.append, self.warned.append
        self.recorder = FaultRecorder("/cell_1", PERIOD, offsets, self.clock, tell, warn)

    def clock(self) -> datetime:
        return BEGUN + timedelta(seconds=self.now)

    def cycle(self, count: int = 1) -> None:
        for _ in range(count):
            setpoint = super().cycle()
            controller = self.controller
            if setpoint is not None:
                self.recorder.add(self.now, setpoint, controller.measured_heights)
            fault = controller.reason.text if controller.state is FAULT else None
            self.recorder.look(self.now, fault, leads=controller.leads)

    def fail(self) -> None:
        """Let the first slider not follow in mid-motion, and wait for what is written of that."""
        self.controller.move_to(PLACES[0])
        self.cycle(60)
        self.offset = 0.03
        self.cycle_until(FAULT)
        self.cycle(2000)
        self.offset = 0.0
        for each in threading.enumerate():
            # Tests before this one may have left threads of their own.
            if each.name == "recording of a fault":
                each.join()

    def recover(self) -> None:
        self.controller.enable(self.now)
        self.cycle_until(IDLE)
        self.controller.move_to(PLACES[1])
        self.cycle_until(IDLE)


def test_the_ten_seconds_before_a_fault_are_judged_as_any_recording() -> None:
    rig = RecordedRig()
    for place in PLACES * 10:
        rig.cycle(300)
        rig.controller.move_to(place)
        rig.cycle_until(IDLE)
    rig.fail()
    (file,) = fault_recordings(fault_folder("/cell_1"))
    assert rig.told == [f"the seconds before the fault are recorded in {file}"]
    remark = file.read_text(encoding="utf-8").splitlines()[0]
    fault_at = float(remark.split()[3])
    assert fault_at > 10.0
    assert remark.split()[5] == "2026-11-29"
    assert file.name.startswith("fault_2026-11-29_00-0")
    assert "slider" in remark
    recording = load_recording(file, ())
    workspace = Workspace(MACHINE, WorkspaceLimits(LOWER, UPPER, 0.005, 6.0))
    judgement = judge(recording, workspace, LIMITS, PERIOD, height_offsets=OFFSETS)
    assert not judgement.violations
    assert judgement.last_speed == 0.0
    assert recording.measured is not None
    # What was wrong is seen in the measured heights, and from when on.
    lag = np.abs(recording.measured - recording.heights).max(axis=1)
    assert lag[recording.stamps < fault_at - 0.1].max() < 0.01
    assert lag[recording.stamps > fault_at].max() > 0.02
    assert recording.heights[0] + OFFSETS == pytest.approx(HOME, abs=0.3)


def test_five_are_kept_the_newest_ones() -> None:
    rig = RecordedRig()
    rig.cycle_until(IDLE)
    for _ in range(7):
        rig.fail()
        rig.recover()
    kept = fault_recordings(fault_folder("/cell_1"))
    assert [str(file) in "".join(rig.told[-5:]) for file in kept] == [True] * 5
    assert not rig.warned


def test_a_folder_that_cannot_be_written_is_one_warning(tmp_path: Path) -> None:
    (tmp_path / "tri_glide_kinematics").write_text("no folder")
    rig = RecordedRig()
    rig.cycle_until(IDLE)
    rig.fail()
    assert [text.partition(":")[0] for text in rig.warned] == ["the fault is not recorded"]
    assert not rig.told
    rig.recover()
