"""The panel in a real browser: start, Stop, processor time, and what it costs the machine."""

import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from statistics import median
from urllib.error import URLError
from urllib.request import urlopen

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState

from benchmarks.machine import processor_time
from benchmarks.table import print_lines
from testing import page_reader
from testing.browser import DESKTOP, Browser, Page, browser, find_browser
from testing.client import Client
from testing.domain import own_context, own_domain, set_transport
from testing.ends import run_in_real_time
from testing.panel import STOP, Panel, tab
from testing.processes import TIMEOUT, launched
from testing.taking import taken_as_sent
from tri_glide_kinematics.ros.starting import COMPUTER, executable
from tri_glide_kinematics.vectors import Vector3

HEAD = ("what", "measured", "to reach")
STOPS = 15
PROGRAMS = 5
CPU_TIME = 15.0  # s
CYCLES_TIME = 15.0  # s
ROUNDS = 4
LOW, HIGH = (0.0, 0.0, 0.2), (0.0, 0.0, 0.42)
# Slow enough for a long stretch at one speed.
SLOW = 0.06
STEADY_TIME = 0.2  # s
PLATFORM = "window.__viserMutable?.nodeRefFromName?.['/measured/platform']?.position?.z"
PROGRAM_LINES = 200_000
DRAWN = "!!window.__viserMutable?.nodeRefFromName?.['/program']"
FRAME_COUNT = "window.__viserTestpoints.rendererInfo.render.frame"


def run() -> bool:
    """Measure all, and print a table; return whether that could be done."""
    if find_browser() is None:
        print("panel: not measured, as no browser is installed")
        return False
    rows: list[tuple[str, str, str]] = []
    with ExitStack() as stack, own_domain(), pytest.MonkeyPatch.context() as patch:
        set_transport(patch, COMPUTER)
        # The token is not that of whoever runs this.
        patch.setenv("XDG_STATE_HOME", stack.enter_context(tempfile.TemporaryDirectory()))
        with browser() as running:
            rows.append(_start(running))
        with own_context() as context, tempfile.TemporaryDirectory() as folder:
            client = Client(context, "/bench_panel")
            with launched(Path(folder), "/bench_panel") as launcher, browser() as running:
                panel = Panel(client, launcher, Path(folder), 500.0)
                without, elsewhere = [], []
                for number in range(ROUNDS):
                    without.append(_late_part(panel))
                    with _page_elsewhere(panel):
                        elsewhere.append(_late_part(panel))
                        if number == 0:
                            rows += _cpu(panel, "a page on another computer", lambda: math.nan)
                page = panel.open(running.page(), DESKTOP, 1.0)
                # To open it takes the whole computer for a moment.
                panel.client.spin_for(5.0)
                panel.recover()
                what = "from the press on Stop to the first braking setpoint, median"
                rows.append((what, _stops(panel, page), "50 ms"))
                rows += _program(panel, page, Path(folder) / "long.ngc")
                rows += _cpu(panel, "a page drawn here", lambda: page.evaluate(FRAME_COUNT))
                here = [_late_part(panel)]
                rows += [
                    _late("a page on another computer", elsewhere, without),
                    _late("a page drawn here, without a graphics card", here, without),
                ]
                if run_in_real_time(panel.machine.ik.pid):
                    what = "a page drawn here, ik_node in real time"
                    rows.append(_late(what, [_late_part(panel)], without))
            client.close()
    return print_lines([HEAD, *rows])


def _start(running: Browser) -> tuple[str, str, str]:
    """Start all as ``make panel`` does, and wait until the page shows the machine in motion."""
    begin = time.monotonic()
    process = subprocess.Popen(
        [str(executable("panel")), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        assert process.stdout
        lines = iter(process.stdout.readline, "")
        address = next(m.group(1) for line in lines if (m := re.search(r"page: (\S+)", line)))
        printed = time.monotonic() - begin
        _wait_for_server(address)
        page = running.page()
        page.open(address, DESKTOP)
        place = page.wait_for(PLATFORM, "the machine", TIMEOUT)
        shown = time.monotonic() - begin
        page.press("document.querySelectorAll('.tri-glide-pad button')[1]")
        page.wait_for(f"Math.abs({PLATFORM} - {place}) > 1e-3", "the machine in motion", TIMEOUT)
        moving = time.monotonic() - begin
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGINT)
        process.wait(TIMEOUT)
    text = f"{moving:.1f} s (address {printed:.1f} s, drawn {shown:.1f} s)"
    return "from make panel until the page shows a moving machine", text, "10 s"


def _wait_for_server(address: str) -> None:
    end = time.monotonic() + TIMEOUT
    while True:
        with suppress(URLError, OSError), urlopen(address, timeout=TIMEOUT):
            return
        assert time.monotonic() < end
        time.sleep(0.02)


def cut(count: int, feed: int) -> Iterator[str]:
    """Yield a smooth course of lines of 0.1 mm, as a CAM program has them."""
    yield f"G21 G90 G64 P0.02\nG1 F{feed}\n"
    angles = np.arange(1, count - 2) * 1e-4 / 0.05
    for a in angles.tolist():
        x, y, z = 50.0 * np.cos(a), 40.0 * np.sin(1.3 * a), 300.0 + 20.0 * np.sin(0.7 * a)
        yield f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}\n"
    yield "M2\n"


def _program(panel: Panel, page: Page, file: Path) -> Iterator[tuple[str, str, str]]:
    """Upload a program of very many lines, and press Stop while others like it are loaded."""
    page.click(tab("Program"))
    times = []
    for number in range(PROGRAMS):
        # What is shown stays if the same program comes again.
        file.write_text("".join(cut(PROGRAM_LINES, 6000 + number)))
        begin = time.monotonic()
        page.choose_file("[data-upload]", file)
        page.wait_for(f"!{DRAWN}" if number else DRAWN, "a new program", spin=panel.spin)
        page.wait_for(DRAWN, "the picture of the program", spin=panel.spin)
        times.append(time.monotonic() - begin)
    later = ", ".join(f"{each:.1f}" for each in sorted(times[1:]))
    text = f"{times[0]:.1f} s (beside a picture of as many, which the processor draws: {later} s)"
    yield f"from the upload of {PROGRAM_LINES:,} lines to their picture", text, "5 s"
    text = _stops(panel, page, lambda: page.choose_file("[data-upload]", file))
    yield "from the press on Stop to braking while they are loaded, median", text, "50 ms"


def _stops(panel: Panel, page: Page, before: Callable[[], None] | None = None) -> str:
    """Measure how late Stop brakes, by the stamps, which are of one clock.

    Args:
        panel: with the machine.
        page: with the button.
        before: is called right before each press, where the page is to be busy.
    """
    commands = panel.client.record(JointState, "joint_commands", take=taken_as_sent)
    panel.client.send_pose(LOW)
    panel.wait_until_at(LOW)
    panel.client.set_parameters("ik_node", {"speed_scale": SLOW})
    delays: list[float] = []
    goals = (HIGH, LOW)
    for number in range(2 * STOPS):
        if len(delays) == STOPS:
            break
        known = len(panel.machine.states)
        _cruise(panel, goals[number % 2], commands)
        place = page.middle_of(STOP)
        page.mouse("mouseMoved", place, buttons=0)
        if before is not None:
            before()
        commands.clear()
        begin = time.time()
        page.mouse("mousePressed", place)
        page.mouse("mouseReleased", place, buttons=0)
        panel.client.wait_for(lambda: commands and not any(commands[-1].velocity), "rest")
        braked = _braked(panel, commands, begin)
        # On a busy computer, the machine may have arrived before the press.
        if braked is not None:
            delays.append(braked - begin)
        # Before the stop is over, no other target is accepted.
        panel.client.wait_for(
            lambda: panel.machine.states_since(known)[-1:] == ["idle"],  # noqa: B023
            "idle",
        )
    panel.client.set_parameters("ik_node", {"speed_scale": 1.0})
    milliseconds = 1000.0 * np.array(delays)
    return (
        f"{median(milliseconds):.1f} ms (5 to 95 %: {np.percentile(milliseconds, 5):.1f} to "
        f"{np.percentile(milliseconds, 95):.1f} ms, {len(delays)} times)"
    )


def _cruise(panel: Panel, goal: Vector3, commands: list[JointState]) -> None:
    """Send the machine away and wait until its speed has been the same for a while."""
    time_of = panel.client.time_of

    def is_steady() -> bool:
        # By time and not by a number of setpoints, which is small where the computer is busy.
        speeds: list[float] = []
        for message in reversed(commands):
            speeds.append(message.velocity[0])
            if time_of(commands[-1]) - time_of(message) > 1e9 * STEADY_TIME:
                return any(commands[-1].velocity) and bool(np.ptp(speeds) < 1e-6)
        return False

    panel.client.send_pose(goal)
    panel.client.wait_for(is_steady, "a steady speed")


def _braked(panel: Panel, commands: list[JointState], begin: float) -> float | None:
    """Return the stamp of the first command after ``begin`` that is slower than the first [s]."""
    stamped = [(1e-9 * panel.client.time_of(message), message) for message in commands]
    later = [(stamp, abs(m.velocity[0])) for stamp, m in stamped if stamp >= begin]
    return next((stamp for stamp, speed in later if speed < later[0][1] * (1.0 - 1e-4)), None)


@contextmanager
def _page_elsewhere(panel: Panel) -> Iterator[None]:
    """Have all read that a page gets, which is drawn where it costs this computer nothing."""
    process = subprocess.Popen([sys.executable, page_reader.__file__, panel.address])
    try:
        panel.client.spin_for(2.0)
        assert process.poll() is None
        yield
    finally:
        process.kill()
        process.wait()
        panel.client.spin_for(4.0)


def _cpu(
    panel: Panel, page: str, frame_count: Callable[[], float]
) -> Iterator[tuple[str, str, str]]:
    """Measure the panel's processor time with a page, in motion and at rest."""
    for what, is_moving in (("a machine in motion", True), ("a machine at rest", False)):
        with _keeping_on(panel, is_moving=is_moving):
            panel.client.spin_for(1.0)
            frames, used = frame_count(), processor_time(panel.node.pid)
            begin = time.monotonic()
            _wander(panel, CPU_TIME, is_moving=is_moving)
            passed = time.monotonic() - begin
            part = 1e-9 * (processor_time(panel.node.pid) - used) / passed
            drawn = (frame_count() - frames) / passed
        text = f"{100.0 * part:.1f} % of a core"
        if math.isfinite(drawn):
            text += f" (the browser drew {drawn:.0f} frames a second)"
        yield f"processor time of panel_node with {page}, {what}", text, "10 %"


@contextmanager
def _keeping_on(panel: Panel, *, is_moving: bool) -> Iterator[None]:
    panel.client.set_parameters("ik_node", {"speed_scale": SLOW})
    if is_moving:
        panel.client.send_pose(HIGH)
    try:
        yield
    finally:
        panel.client.set_parameters("ik_node", {"speed_scale": 1.0})


def _wander(panel: Panel, duration: float, *, is_moving: bool) -> None:
    """Let a time pass, with the machine going up and down if it is to move."""
    end = time.monotonic() + duration
    goals = (LOW, HIGH)
    number = 0
    while (left := end - time.monotonic()) > 0.0:
        if is_moving and panel.machine.state == "idle":
            panel.client.send_pose(goals[number % 2])
            number += 1
        panel.client.spin_for(min(0.1, left))


def _late(what: str, parts: list[float], without: list[float]) -> tuple[str, str, str]:
    """Return a row of the parts of cycles that were late with a page, and with none."""
    told, told_without = (
        ", ".join(f"{100.0 * part:.2f}" for part in sorted(each)) for each in (parts, without)
    )
    return (
        f"late cycles of ik_node: with {what}; with none",
        f"{told} %; {told_without} %",
        "at most 0.5 points more",
    )


def _late_part(panel: Panel) -> float:
    """Return which part of the cycles of ik_node is late while the machine moves."""
    reports = panel.client.record(DiagnosticArray, "/diagnostics")
    with _keeping_on(panel, is_moving=True):
        _wander(panel, CYCLES_TIME, is_moving=True)
    name = f"{panel.client.namespace}/ik_node"[1:]
    counts = [
        int(entry.value)
        for report in reports
        for status in report.status
        if status.name == name
        for entry in status.values
        if entry.key == "late cycles in the last second"
    ]
    return sum(counts) / (500.0 * max(len(counts), 1))
