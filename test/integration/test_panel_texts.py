"""The panel by pages that know its texts and controls: programs, steps, points, two pages.

What takes a browser is in ``test_panel.py``: what is drawn, and what a page does by itself.
"""

import math
import re
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from std_srvs.srv import SetBool

from testing.panel import Panel
from testing.text_page import RENEWALS, TextPage
from tri_glide_interfaces.msg import Output, ProgramRun
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.panel.tabs import SHOW_PERIOD
from tri_glide_kinematics.programs import PathStep, load_drive
from tri_glide_kinematics.recordings import load_recording
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS

pytestmark = pytest.mark.slow

# Line 4 takes 4 s; line 6 is driven after the stop.
SQUARE = """\
G21 G90 G17 (mm)
G0 X0 Y0 Z260
G1 X-20 F6000
G1 X60 F1200
M0
G3 X20 Y0 I-20 J0 F6000
G1 X0
M2
"""


def square_to(x: int) -> str:
    """Return the program with another way to the right [mm]."""
    return SQUARE.replace("X60", f"X{x}").replace("X20 Y0", f"X{x - 40} Y0")


# Name of the drawn path in the scene.
PATH = "/program"


@pytest.fixture(scope="module")
def first(panel: Panel) -> Iterator[TextPage]:
    """Return the first page, which has the controls."""
    with closing(TextPage(panel.address)) as page:
        yield page


@pytest.fixture
def page(panel: Panel, first: TextPage) -> TextPage:
    """Return the first page, with the machine at rest in its middle, whatever was before."""
    first.tab = "Drive"
    panel.client.wait_for(lambda: first.strip, "the page")
    if first.strip["left"]:
        # A run that still waits would keep all else from being chosen.
        first.stop()
        panel.client.wait_for(lambda: not first.strip["left"], "the end of it")
    panel.bring_home()
    panel.read_until(first, "idle")
    panel.client.wait_for(lambda: "you are" not in first.text, "controls that are free")
    if "nobody has" in first.text:
        first.click("take")
        panel.client.wait_for(lambda: "nobody has" not in first.text, "the controls")
    return first


@pytest.fixture
def second(panel: Panel) -> Iterator[TextPage]:
    """Return a page that looks on."""
    with closing(TextPage(panel.address)) as page:
        panel.read_until(page, "has the controls")
        yield page


@pytest.fixture
def operator(panel: Panel, page: TextPage) -> TextPage:
    """Return the first page, which shows the tab of programs, whatever one before has set."""
    page.tab = "Program"
    page.set("Single block", False)
    panel.client.set_parameters("ik_node", {"path_speed_scale": 1.0})
    return page


def test_only_what_is_new_and_seen_is_sent(panel: Panel, page: TextPage) -> None:
    plots = page.plots
    panel.client.send_pose((0.03, 0.0, 0.3))
    panel.wait_until_at((0.03, 0.0, 0.3))
    # Those of a closed tab are not.
    assert page.plots == plots
    # The curves are sent until the motion is out of them: meanwhile others are looked at.
    for name in ("Swing", "Numbers", "Drive", "Curves"):
        page.tab = name
        if name == "Curves":
            panel.client.wait_for(lambda: page.plots > plots, "the curves")
        known = len(page.loads)
        # A sign of life comes each second: a machine at rest costs no more than 5 kB/s.
        panel.client.wait_for(
            lambda: len(page.loads) > known + 1 and page.loads[-1] < 5000,  # noqa: B023
            f"silence on {name}",
        )


def part_done(operator: TextPage) -> int:
    """Return how much of a program the bar shows to be done [%]."""
    found = re.search(r"(\d+) % (?:running|waiting)", operator.text)
    assert found
    return int(found.group(1))


def test_a_program_runs_is_paused_jogged_and_goes_on_where_it_was(
    panel: Panel, operator: TextPage
) -> None:
    operator.upload("square.ngc", SQUARE)
    panel.read_until(operator, "-20 to 60 mm")
    operator.click("check")
    panel.read_until(operator, "duration 0:")
    # So slow that a busy computer can pause it.
    operator.set("Override [%]", 20)
    operator.set("Single block", True)
    operator.click("run")
    panel.read_until(operator, "waits: line 3 is next")
    operator.set("Single block", False)
    operator.click("go on")
    panel.read_until(operator, "running: line 4 of 8")
    panel.read_until(operator, "G1 X60")
    # F is 20 mm/s.
    panel.read_until(operator, " 4.0 mm/s")
    panel.read_until(operator, "left of square.ngc")
    # The line is shown as soon as it is next.
    panel.client.wait_for(lambda: panel.position[0] > -0.019, "the way of it")
    operator.click("pause")
    panel.machine.wait_for_state("paused")
    operator.set("Override [%]", 100)
    panel.client.wait_for(lambda: panel.is_at_rest, "rest on the path")
    paused = panel.position
    assert -0.02 < paused[0] < 0.06
    panel.client.spin_for(2.0 * SHOW_PERIOD)
    done = part_done(operator)
    assert 0 < done < 100
    # Held by a topic: a jog by hand is the same to the machine.
    for _ in range(20):
        panel.client.send_twist((0.0, 0.05, 0.0))
        panel.client.spin_for(0.03)
    panel.machine.wait_for_state("idle")
    panel.read_until(operator, "moved while the path was paused")
    assert panel.position[1] > 0.005
    panel.client.spin_for(2.0 * SHOW_PERIOD)
    assert abs(part_done(operator) - done) <= 1
    positions = []
    operator.click("go on")
    panel.client.wait_for(
        lambda: positions.append(panel.position) or math.dist(paused, positions[-1]) < 1e-3,
        "the place of the pause",
    )
    panel.read_until(operator, "waiting: line 5 of 8")
    panel.wait_until_at((0.06, 0.0, 0.26))
    operator.click("go on")
    panel.read_until(operator, "done: line 8 of 8")
    panel.wait_until_at((0.0, 0.0, 0.26))


def test_a_run_that_is_stopped_goes_on_from_its_line(panel: Panel, operator: TextPage) -> None:
    operator.upload("stopped.ngc", square_to(61))
    # The next program begins where this one is: its own range has to be the larger one.
    panel.read_until(operator, "-20 to 61 mm")
    operator.click("run")
    panel.read_until(operator, "running: line 4 of 8")
    operator.click("stop")
    panel.read_until(operator, "ended: line 4 of 8")
    assert operator.value_of("From line") == "4"
    # The operator's own stop is no refusal.
    panel.client.spin_for(2.0 * SHOW_PERIOD)
    assert "stopped.ngc" not in operator.strip["refusal"]
    # The way back is no faster than the operator wants.
    panel.client.send_pose((0.0, -0.03, 0.26))
    panel.wait_until_at((0.0, -0.03, 0.26))
    operator.set("To the start [mm/s]", "20")
    operator.click("run")
    panel.read_until(operator, "20.0 mm/s")
    operator.set("To the start [mm/s]", "50")
    panel.read_until(operator, "waiting: line 5 of 8")
    # Stop of the page ends what only waits, too.
    operator.stop()
    panel.read_until(operator, "ended: line 5 of 8")


# Driving


def test_no_field_alters_what_is_typed_until_it_is_a_number(page: TextPage) -> None:
    """So do those of viser for numbers: 0.4 would be 4, and 2,5 be 25."""
    assert not {"GuiNumberMessage", "GuiVector2Message", "GuiVector3Message"} & page.kinds


def test_the_camera_has_views(panel: Panel, page: TextPage) -> None:
    def camera(view: str) -> np.ndarray:
        page.camera.clear()
        page.click(view)
        panel.client.wait_for(lambda: len(page.camera) == 2, view)
        return np.subtract(page.camera["position"], page.camera["look_at"])

    top, front, fit = map(camera, ("top", "front", "fit"))
    distance = np.linalg.norm(fit)
    assert top == pytest.approx((0.0, 0.0, distance), abs=0.01 * distance)
    assert front == pytest.approx((0.0, -distance, 0.0), abs=1e-6)
    assert min(abs(fit)) > 0.05


def test_what_is_typed_is_driven_from_the_work_zero_and_switches_outputs(
    panel: Panel, page: TextPage
) -> None:
    told: list[tuple[str, int, float]] = []
    panel.client.node.create_subscription(
        Output, "outputs", lambda it: told.append((it.name, it.number, it.value)), LATEST_OUTPUTS
    )
    page.tab = "Program"
    page.upload("near.ngc", "G21 G90\nG0 X0 Y0 Z250\nG1 X5 F6000\nM2\n")
    panel.read_until(page, "x 0 to 5 mm")
    page.tab = "Drive"
    panel.client.send_pose((0.01, 0.0, 0.26))
    panel.wait_until_at((0.01, 0.0, 0.26))
    page.set("This place is [mm]", "2,5")
    # Refused while the speed that was told last is not that of rest.
    panel.repeat_until(
        lambda: page.click("x"),
        lambda timeout: panel.read_until(page, "G54: X 2.50 Y 0.00 Z 260.00 mm", timeout),
    )
    # What was read before is read again.
    page.tab = "Program"
    panel.read_until(page, "x 0 to 12.5 mm")
    page.tab = "Drive"
    page.type_line("G0 X900")
    panel.read_until(page, "typed: line 1: segment 1 of the path: outside the workspace")
    page.type_line("G1 X12.5 F6000")
    panel.wait_until_at((0.02, 0.0, 0.26))
    panel.read_until(page, "G1 X12.5 F6000: done")
    page.click("clear")
    panel.client.wait_for(lambda: "G54" not in page.strip["position"], "no work zero")
    page.type_line("M64 P3")
    panel.client.wait_for(lambda: page.value_of("digital 3"), "M64")
    page.set("M3, or M4 if < 0 [1/min]", "-800")
    page.set("spindle", True)
    panel.client.wait_for(lambda: ("spindle", 0, -800.0) in told, "the spindle")
    page.set("spindle", False)
    panel.client.wait_for(lambda: told[-1] == ("spindle", 0, 0.0), "the end of the spindle")


# What the fields show while a shaper waits, or another sets it: test/panel/tabs/test_swing_tab.py.
def test_a_shaper_is_switched_and_a_refusal_tells_number_and_bound(
    panel: Panel, page: TextPage
) -> None:
    page.tab = "Swing"
    panel.read_until(page, "in force: no shaper")
    told = "zvd for 18.5 Hz, 4 %"
    page.set("Kind", "zvd")
    page.set("Mode [Hz]", "18,5")
    page.set("Mode [% damping]", "4")
    page.click("Set")
    panel.read_until(page, f"in force: {told}")
    for change in ("shaper: none -> zvd", "[15] Hz -> [18.5] Hz", "[0.05] -> [0.04]"):
        assert change in panel.machine.ik.output
    # All of it or nothing.
    page.set("Kind", "none")
    page.set("Mode [Hz]", "900")
    page.click("Set")
    panel.read_until(page, "900 Hz must be at most 500 Hz")
    assert f"in force: {told}" in page.text
    panel.client.set_parameters("ik_node", {"shaper": "none", "mode_frequencies": [15.0]})


def test_points_are_taught_driven_and_saved(panel: Panel, page: TextPage) -> None:
    page.tab = "Points"
    places = [(0.03, 0.0, 0.25), (0.03, 0.03, 0.27)]
    for place in places:
        panel.client.send_pose(place)
        panel.wait_until_at(place)
        panel.client.spin_for(0.2)
        panel.client.wait_for(lambda: panel.machine.states[-1].target_reached, "measured rest")
        panel.client.spin_for(0.2)
        page.click("Teach this position")
        panel.read_until(page, " ".join(f"{1000.0 * part:.2f}" for part in place))
    page.click("save")
    panel.read_until(page, "points saved as")
    (step,) = load_drive(panel.points_file).steps
    assert isinstance(step, PathStep)
    assert step.segments.numbers.reshape(-1, 3)[-2:] == pytest.approx(np.array(places), abs=1e-4)
    panel.bring_home()
    page.click("Drive through them")
    panel.wait_until_at(places[-1])


# Two pages


def test_a_fault_is_recorded_and_drawn_and_sent_to_the_page(
    panel: Panel, page: TextPage, tmp_path: Path
) -> None:
    def told() -> list[str]:
        return [each["press"] for each in page.history if "are recorded" in each["text"]]

    page.tab = "Curves"
    panel.client.wait_for(lambda: page.choices_of("Curves of"), "what can be drawn")
    before = told()
    panel.client.send_pose((0.03, 0.0, 0.25))
    panel.wait_for_motion()
    simulator = panel.machine.simulator.process
    simulator.send_signal(signal.SIGSTOP)
    try:
        panel.machine.wait_for_state("fault")
        panel.client.wait_for(lambda: told() != before, "the recording")
        panel.read_until(page, "mm when last measured")
    finally:
        simulator.send_signal(signal.SIGCONT)
    page.press_history("are recorded")
    panel.read_until(page, "fault at")
    name = page.value_of("Curves of")
    page.click("Download the recording")
    file = tmp_path / f"{name}.csv"
    panel.client.wait_for(lambda: file.name in page.downloads, "the file")
    panel.client.wait_for(lambda: b"".join(page.downloads[file.name]).endswith(b"\n"), "all of it")
    file.write_bytes(b"".join(page.downloads[file.name]))
    recording = load_recording(file, ())
    assert recording.measured is not None
    assert recording.velocities is not None
    assert np.abs(recording.velocities).max() > 0.01
    assert not recording.velocities[-1].any()
    page.set("Curves of", page.choices_of("Curves of")[0])
    panel.client.wait_for(lambda: "fault at" not in page.text, "the curves of now")


def test_the_teach_mode_is_switched_on_by_any_page_and_off_by_the_one_with_the_controls(
    panel: Panel, page: TextPage, second: TextPage
) -> None:
    box, words = "Teach mode", "teach mode · at most 250 mm/s"

    def wait_until_all_know(is_on: bool) -> None:
        panel.client.wait_for(lambda: panel.machine.states[-1].teach_mode == is_on, "ik_node")
        for each in (page, second):
            panel.client.wait_for(
                lambda each=each: (each.value_of(box), words in each.text) == (is_on, is_on),
                f"{is_on} on a page",
            )

    second.set(box, True)
    wait_until_all_know(True)
    second.set(box, False)
    panel.read_until(second, "nothing done")
    # The box goes back.
    wait_until_all_know(True)
    page.set(box, False)
    wait_until_all_know(False)
    # What another client has switched.
    for is_on in (True, False):
        panel.client.call(SetBool, "ik_node/teach_mode", SetBool.Request(data=is_on))
        wait_until_all_know(is_on)


def test_a_page_that_is_cut_off_ends_its_jog_and_loses_the_controls(
    panel: Panel, page: TextPage, second: TextPage
) -> None:
    """The panel sees no more of a browser that is killed."""
    page.click("give up")
    panel.read_until(second, "nobody has the controls")
    second.click("take")
    panel.read_until(second, "you have the controls")

    def jogs() -> bool:
        second.hold("Y+")
        panel.client.spin_for(1.0 / RENEWALS)
        return panel.position[1] > 0.003

    panel.client.wait_for(jogs, "a jog for as long as it is held")
    second.cut()
    panel.wait_for_end_of_jog()
    panel.read_until(page, "nobody has the controls")


# What ends a node


def test_a_run_ends_when_another_ik_node_was_started(panel: Panel, operator: TextPage) -> None:
    operator.upload("square.ngc", SQUARE)
    panel.read_until(operator, "-20 to 60 mm")
    operator.click("run")
    panel.read_until(operator, "running: line 4 of 8")
    panel.machine.ik.signal(signal.SIGKILL)
    panel.machine.start_ik(panel.parameters)
    panel.read_until(operator, "ended: line 4 of 8")
    panel.read_until(operator, "square.ngc: another ik_node was started")
    assert operator.value_of("From line") == "4"


def test_a_run_that_another_node_drives_is_shown_and_taken_for_gone(
    panel: Panel, operator: TextPage
) -> None:
    run = ProgramRun(run=7, driver="other", file="/else/part.ngc", line=30, lines=120, state=1)
    publisher = panel.client.publisher(ProgramRun, "program_run")
    timer = panel.client.node.create_timer(0.1, lambda: publisher.publish(run))
    panel.read_until(operator, "other runs part.ngc: line 30 of 120")
    operator.upload("square.ngc", square_to(66))
    panel.read_until(operator, "-20 to 66 mm")
    operator.click("run")
    panel.read_until(operator, "nothing begun: other runs /else/part.ngc")
    # Whoever has it move: it is stopped, and the run with it.
    panel.stop_on_the_way(lambda: operator.click("stop"))
    panel.client.node.destroy_timer(timer)
    panel.read_until(operator, "part.ngc ended at line 30, because what drove it is gone")
    panel.read_until(operator, "what drove a program is gone: it told nothing for 1 s")
    panel.bring_home()


def test_the_next_panel_tells_where_the_program_of_one_that_was_killed_has_ended(
    client, nodes, tmp_path
) -> None:
    panel = Panel(client, nodes, tmp_path)
    outputs = client.record(Output, "outputs", LATEST_OUTPUTS)

    def is_on() -> bool:
        values = {each.name: each.value for each in outputs}
        return any(values.get(name) for name in ("spindle", "flood"))

    lines = "".join(f"X{8 * (n % 2)} Y{0.1 * n:.1f}\n" for n in range(200))
    with closing(TextPage(panel.address, "Program")) as page:
        panel.read_until(page, "ready idle")
        page.tab = "Drive"
        page.set("Button", "right")
        page.type_line("G91 G1 X1 F6000")
        panel.read_until(page, "G91 G1 X1 F6000: done")
        page.click("newest line")
        client.wait_for(lambda: "right" in page.buttons, "a button")
        page.tab = "Program"
        page.upload("part.ngc", f"M3 S500 M8\nG1 X0 Y0 Z260 F600\n{lines}M9\nM5\nM2\n")
        panel.read_until(page, "lines 205")
        page.click("run")
        client.wait_for(is_on, "the spindle")
        panel.read_until(page, "running: line 5 of 205")
        panel.node.signal(signal.SIGKILL)
    client.wait_for(lambda: not is_on(), "outputs that are off")
    client.wait_for(lambda: panel.machine.cause is Cause.PROGRAM_LOST, "the lost run")
    assert panel.is_at_rest
    panel.start_node()
    with closing(TextPage(panel.address, "Program")) as page:
        panel.read_until(page, "because what drove it is gone")
        panel.read_until(page, "lines 205")
        line = int(page.value_of("From line"))
        assert f"part.ngc ended at line {line}, because" in page.text
        assert 2 < line < 30
        page.tab = "Drive"
        client.wait_for(lambda: "right" in page.buttons, "the button of before")
        page.tab = "Program"
        # A panel that is told to end waits for rest, and switches off.
        page.click("run")
        client.wait_for(is_on, "the spindle")
        panel.read_until(page, "running: line ")
        panel.wait_for_motion()
        assert panel.node.signal(signal.SIGTERM) == 0
    client.wait_for(lambda: not is_on(), "outputs that are off")
    client.wait_for(lambda: panel.machine.cause is Cause.CANCELLED, "the end of the run")
    assert panel.is_at_rest
