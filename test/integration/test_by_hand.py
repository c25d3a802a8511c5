"""The panel by a page without a browser: work zero, a typed line, and outputs."""

import signal
from collections.abc import Iterator
from contextlib import closing

import pytest
from std_srvs.srv import SetBool

from testing.panel import Panel
from testing.text_page import TextPage
from tri_glide_interfaces.msg import Output
from tri_glide_kinematics.programs import load_zeros
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page(panel: Panel) -> Iterator[TextPage]:
    """Return a page that has the controls."""
    with closing(TextPage(panel.address)) as page:
        panel.read_until(page, "idle")
        yield page


@pytest.fixture
def operator(panel: Panel, page: TextPage) -> TextPage:
    """Return the page, with the machine at rest in its middle."""
    page.tab = "Drive"
    panel.bring_home()
    panel.read_until(page, "idle")
    return page


def test_a_typed_line_is_proved_and_driven_from_a_work_zero_that_was_touched_off(
    panel: Panel, operator: TextPage
) -> None:
    operator.tab = "Program"
    operator.upload("near.ngc", "G21 G90\nG0 X0 Y0 Z250\nG1 X5 F6000\nM2\n")
    panel.read_until(operator, "x 0 to 5 mm")
    operator.tab = "Drive"
    panel.client.send_pose((0.01, 0.0, 0.26))
    panel.wait_until_at((0.01, 0.0, 0.26))
    panel.read_until(operator, "idle")
    operator.set("This place is [mm]", "2,5")
    # Refused while the speed that was told last is not that of rest.
    panel.repeat_until(
        lambda: operator.click("x"),
        lambda timeout: panel.read_until(operator, "G54: X 2.50 Y 0.00 Z 260.00 mm", timeout),
    )
    assert load_zeros(panel.programs.parent / "work_zero.yaml")["G54"] == pytest.approx(
        (0.0075, 0.0, 0.0)
    )
    # What was read before is read again.
    operator.tab = "Program"
    panel.read_until(operator, "x 0 to 12.5 mm")
    operator.tab = "Drive"
    operator.type_line("G0 X900")
    panel.read_until(operator, "typed: line 1: segment 1 of the path: outside the workspace")
    operator.type_line("G0 Xten")
    panel.read_until(operator, "typed: line 1, column 4: Xten")
    operator.type_line("G1 X12.5 F6000")
    panel.wait_until_at((0.02, 0.0, 0.26))
    panel.read_until(operator, "G1 X12.5 F6000: done")
    # Stop ends one that is driven; the next one begins as the first did, but from there.
    operator.type_line("G91 G1 X-30 F300")
    panel.wait_for_motion()
    operator.stop()
    panel.machine.wait_for_state("idle")
    panel.client.wait_for(lambda: panel.is_at_rest, "rest")
    assert 0.0 < panel.position[0] < 0.02
    # Where the setpoints end, the measured place has a work position, too.
    panel.client.call(SetBool, "ik_node/enable", SetBool.Request(data=False))
    panel.read_until(operator, "mm measured G54: X")
    operator.type_line("G0 X0")
    panel.read_until(operator, "the machine is disabled, and has to be idle")
    operator.click("clear")
    panel.client.wait_for(lambda: "G54" not in operator.strip["position"], "no work zero")
    panel.client.call(SetBool, "ik_node/enable", SetBool.Request(data=True))


def test_outputs_have_a_switch_that_shows_what_is_told(panel: Panel, operator: TextPage) -> None:
    told: list[tuple[str, int, float]] = []
    panel.client.node.create_subscription(
        Output, "outputs", lambda it: told.append((it.name, it.number, it.value)), LATEST_OUTPUTS
    )
    operator.set("M3, or M4 if < 0 [1/min]", "-800")
    operator.set("spindle", True)
    panel.client.wait_for(lambda: ("spindle", 0, -800.0) in told, "the spindle")
    panel.read_until(operator, "spindle -800")
    panel.client.wait_for(lambda: operator.value_of("spindle"), "its switch")
    operator.type_line("M64 P3")
    panel.read_until(operator, "digital 3 1")
    panel.client.wait_for(lambda: operator.value_of("digital 3"), "what a line has switched")
    # Off at any time, on only where the machine may move.
    panel.client.call(SetBool, "ik_node/enable", SetBool.Request(data=False))
    # A refusal before has this word, too.
    panel.read_until(operator, "disabled somebody has disabled it")
    operator.set("spindle", False)
    panel.client.wait_for(lambda: told[-1] == ("spindle", 0, 0.0), "the end of the spindle")
    operator.set("flood", True)
    panel.read_until(operator, "flood not switched on: the machine is disabled")
    panel.client.call(SetBool, "ik_node/enable", SetBool.Request(data=True))
    # Not beside a program that does so itself.
    operator.tab = "Program"
    operator.upload("mist.ngc", "G21 M7\nG0 X0 Y0 Z250\nM0\nG0 X6\nM2\n")
    # No other program of this file has these numbers: until it is read, the one before is shown.
    panel.read_until(operator, "x 0 to 6 mm")
    operator.click("run")
    panel.read_until(operator, "waits: line 3: M0")
    operator.tab = "Drive"
    panel.read_until(operator, "mist.ngc waits: line 3: M0")
    operator.set("mist", False)
    panel.read_until(operator, "mist not switched: the program that runs does so")
    operator.type_line("M9")
    panel.read_until(operator, "nothing driven: a program runs")
    operator.stop()
    panel.client.wait_for(lambda: told[-1] == ("mist", 0, 0.0), "the end of the program")
    assert ("flood", 0, 1.0) not in told


def test_own_buttons_run_as_a_typed_line_does_and_are_there_after_a_restart(
    panel: Panel, operator: TextPage
) -> None:
    operator.click("newest line")
    panel.read_until(operator, "a name has 1 to 24 characters that can be printed, not 0")
    operator.set("Button", "right")
    operator.type_line("G91 G1 X3 F6000")
    panel.read_until(operator, "G91 G1 X3 F6000: done")
    operator.click("newest line")
    panel.client.wait_for(lambda: "right" in operator.buttons, "a button")
    operator.click("chosen file")
    panel.read_until(operator, "nothing made: there is a button right already")
    operator.tab = "Program"
    operator.upload("ring.ngc", "G21 G91\nG0 Z2\nG2 I5 F6000\nG0 Z-2\nM2\n")
    panel.read_until(operator, "z 300 to 302 mm")
    operator.tab = "Drive"
    operator.set("Button", "far")
    operator.type_line("G0 X900")
    operator.click("newest line")
    panel.client.wait_for(lambda: "far" in operator.buttons, "a second button")
    operator.set("Button", "ring")
    operator.click("chosen file")
    panel.client.wait_for(lambda: "ring" in operator.buttons, "a button of a file")
    assert panel.node.signal(signal.SIGTERM) == 0
    panel.start_node()
    with closing(TextPage(panel.address)) as page:
        panel.read_until(page, "idle")
        page.click("right")
        panel.read_until(page, "right: done")
        panel.wait_until_at((0.006, 0.0, 0.25))
        page.click("ring")
        panel.read_until(page, "ring: done")
        panel.wait_until_at((0.006, 0.0, 0.25))
        page.click("far")
        panel.read_until(page, "far: line 1: segment 1 of the path: outside the workspace")
        page.set("Button", "ring")
        page.click("remove")
        panel.client.wait_for(lambda: "ring" not in page.buttons, "no button of a file")
        assert {"right", "far"} < set(page.buttons)
