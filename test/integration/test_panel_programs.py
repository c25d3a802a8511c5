"""Programs in the panel, in a real browser: uploaded, seen, and run."""

from __future__ import annotations

import json
import math
import signal
from pathlib import Path

import pytest

from testing.browser import Browser, Page, find_browser
from testing.panel import STOP, Panel, button, field, tab
from tri_glide_kinematics.panel.programs import NO_FILE

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no browser is installed"),
]

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


PIXELS = "!!window.__viserMutable?.nodeRefFromName?.['/program']"


@pytest.fixture(scope="module")
def operator(panel: Panel, chromium: Browser) -> Page:
    page = panel.open(chromium.page())
    page.click(tab("Program"))
    return page


def wait_for_text(panel: Panel, page: Page, text: str) -> None:
    found = f"document.body.innerText.includes({json.dumps(text)})"
    try:
        page.wait_for(found, f"{text!r} on the page", spin=panel.spin)
    except TimeoutError as error:
        raise TimeoutError(f"{error}: {page.evaluate('document.body.innerText')}") from error


def upload(page: Page, file: Path, text: str | bytes) -> None:
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    page.choose_file("[data-upload]", file)


def test_a_file_is_seen_and_checked_and_one_that_is_wrong_tells_its_line(
    panel: Panel, operator: Page, tmp_path: Path
) -> None:
    upload(operator, tmp_path / "square.ngc", SQUARE)
    wait_for_text(panel, operator, "-20 to 60 mm")
    operator.wait_for(PIXELS, "the path", spin=panel.spin)
    assert (panel.programs / "square.ngc").read_text() == SQUARE
    operator.click(button("check"))
    wait_for_text(panel, operator, "duration\t0:0")
    # It holds for the limits of that time.
    panel.client.set_parameters("ik_node", {"speed_scale": 0.5})
    wait_for_text(panel, operator, "have changed since the check")
    wait_for_text(panel, operator, "duration\tnot known before the check")
    operator.click(button("check"))
    wait_for_text(panel, operator, "duration\t0:0")
    assert not operator.evaluate("document.body.innerText.includes('changed since the check')")
    panel.client.set_parameters("ik_node", {"speed_scale": 1.0})
    upload(operator, tmp_path / "wrong.ngc", "G21\nG1 X0 Y0 Z260 F500\nG1 Xten\nM2\n")
    wait_for_text(panel, operator, "wrong.ngc: line 3")
    assert not operator.evaluate(PIXELS)
    upload(operator, tmp_path / "far.ngc", "G21\nG1 X0 Y0 Z260 F500\nG1 X900\nM2\n")
    wait_for_text(panel, operator, "line 3 leads outside the workspace")
    # The proof does not hide it, neither while it goes on nor afterwards.
    operator.click(button("check"))
    operator.click(button("run"))
    panel.click_for_words(operator, button("run"), "nothing begun: line 3", "refusal")
    upload(operator, tmp_path / "nul.ngc", bytes(10_000))
    wait_for_text(panel, operator, "nul.ngc: is no text in UTF-8")
    upload(operator, tmp_path / "empty.ngc", b"")
    panel.wait_for_words(operator, "empty.ngc is empty", "refusal")
    assert not (panel.programs / "empty.ngc").exists()
    # A file that is gone from the folder is gone from the page.
    (panel.programs / "nul.ngc").unlink()
    panel.wait_for_words(operator, "nul.ngc is no longer in the folder", "refusal")


def test_a_program_runs_is_paused_jogged_and_goes_on_where_it_was(
    panel: Panel, operator: Page, tmp_path: Path
) -> None:
    upload(operator, tmp_path / "square.ngc", SQUARE)
    wait_for_text(panel, operator, "-20 to 60 mm")
    operator.click(button("run"))
    wait_for_text(panel, operator, "running: line 4 of 8")
    wait_for_text(panel, operator, "G1 X60")
    operator.click(button("pause"))
    panel.wait_for_state(operator, "paused")
    panel.client.wait_for(lambda: panel.is_at_rest, "rest on the path")
    paused = panel.position
    assert -0.02 < paused[0] < 0.06
    # Held by a topic: a jog by hand is the same to the machine.
    for _ in range(20):
        panel.client.send_twist((0.0, 0.05, 0.0))
        panel.client.spin_for(0.03)
    panel.wait_for_state(operator, "idle")
    wait_for_text(panel, operator, "moved while the path was paused")
    assert panel.position[1] > 0.005
    positions = []
    operator.click(button("go on"))
    panel.client.wait_for(
        lambda: positions.append(panel.position) or math.dist(paused, positions[-1]) < 1e-3,
        "the place of the pause",
    )
    wait_for_text(panel, operator, "waiting: line 5 of 8")
    panel.wait_until_at((0.06, 0.0, 0.26))
    operator.click(button("go on"))
    wait_for_text(panel, operator, "done: line 8 of 8")
    panel.wait_until_at((0.0, 0.0, 0.26))


def test_a_run_that_is_stopped_goes_on_from_its_line(
    panel: Panel, operator: Page, tmp_path: Path
) -> None:
    upload(operator, tmp_path / "stopped.ngc", square_to(61))
    # The next program begins where this one is: its own range has to be the larger one.
    wait_for_text(panel, operator, "-20 to 61 mm")
    operator.click(button("run"))
    wait_for_text(panel, operator, "running: line 4 of 8")
    operator.click(button("stop"))
    wait_for_text(panel, operator, "ended: line 4 of 8")
    assert operator.evaluate(f"{field('From line')}.value") == "4"
    operator.click(button("run"))
    wait_for_text(panel, operator, "waiting: line 5 of 8")
    # Stop of the page ends what only waits, too.
    operator.click(STOP)
    wait_for_text(panel, operator, "ended: line 5 of 8")


def test_single_block_and_override_are_those_of_the_page_and_the_dialect_stays(
    panel: Panel, operator: Page, tmp_path: Path
) -> None:
    # Wherever the platform is, line 2 moves it.
    upload(operator, tmp_path / "blocks.ngc", square_to(62).replace("G0 X0", "G0 X7"))
    wait_for_text(panel, operator, "-20 to 62 mm")
    operator.click(button("check"))
    wait_for_text(panel, operator, "duration\t0:")
    operator.click(field("Single block"))
    operator.click(button("run"))
    operator.type(field("Override [%]"), "200")
    wait_for_text(panel, operator, "waits: line 3 is next")
    wait_for_text(panel, operator, "left at 100 %")
    panel.wait_until_at((0.007, 0.0, 0.26))
    panel.click_choice(operator, "Dialect", "marlin")
    panel.wait_for_words(operator, "dialect not changed: blocks.ngc runs", "refusal")
    operator.wait_for(
        f"{field('Dialect')}.value === 'as in the settings'", "the dialect", spin=panel.spin
    )
    operator.click(button("go on"))
    wait_for_text(panel, operator, "waits: line 4 is next")
    operator.click(field("Single block"))
    operator.click(button("go on"))
    # F is 20 mm/s.
    panel.wait_for_words(operator, "40.0 mm/s", "speed")
    operator.type(field("Override [%]"), "100")
    wait_for_text(panel, operator, "waiting: line 5 of 8")
    operator.click(button("stop"))
    wait_for_text(panel, operator, "ended: line 5 of 8")


def test_a_file_that_was_replaced_is_read_again(
    panel: Panel, operator: Page, tmp_path: Path
) -> None:
    file = tmp_path / "other.ngc"
    upload(operator, file, square_to(65))
    wait_for_text(panel, operator, "-20 to 65 mm")
    operator.click(button("run"))
    wait_for_text(panel, operator, "running: line 4 of 8")
    upload(operator, file, square_to(70))
    panel.wait_for_words(operator, "other.ngc runs as it was", "refusal")
    wait_for_text(panel, operator, "what runs is what was read before")
    operator.click(button("stop"))
    wait_for_text(panel, operator, "-20 to 70 mm")
    assert operator.evaluate(f"{field('From line')}.value") == "1"
    (panel.programs / "other.ngc").write_text(square_to(75))
    wait_for_text(panel, operator, "-20 to 75 mm")


def test_a_file_that_is_called_like_the_choice_of_none_ends_no_page(
    panel: Panel, operator: Page, tmp_path: Path
) -> None:
    upload(operator, tmp_path / NO_FILE, SQUARE)
    panel.wait_for_words(operator, "no file can be called", "refusal")
    panel.programs.mkdir(exist_ok=True)
    (panel.programs / NO_FILE).write_text(SQUARE)
    upload(operator, tmp_path / "after.ngc", square_to(80))
    wait_for_text(panel, operator, "-20 to 80 mm")
    (panel.programs / "after.ngc").unlink()
    panel.wait_for_words(operator, "after.ngc is no longer in the folder", "refusal")


def test_a_run_ends_when_another_ik_node_was_started(
    panel: Panel, operator: Page, tmp_path: Path
) -> None:
    upload(operator, tmp_path / "square.ngc", SQUARE)
    wait_for_text(panel, operator, "-20 to 60 mm")
    operator.click(button("run"))
    wait_for_text(panel, operator, "running: line 4 of 8")
    panel.machine.ik.signal(signal.SIGKILL)
    panel.machine.start_ik(panel.parameters)
    wait_for_text(panel, operator, "ended: line 4 of 8")
    panel.wait_for_words(operator, "square.ngc: another ik_node was started", "refusal")
    assert operator.evaluate(f"{field('From line')}.value") == "4"


def test_a_page_that_only_looks_on_may_stop_a_program(
    panel: Panel, operator: Page, chromium: Browser, tmp_path: Path
) -> None:
    """It is the last one: the operator's page is hidden by then."""
    panel.recover()
    upload(operator, tmp_path / "wide.ngc", square_to(61).replace("F1200", "F6000"))
    wait_for_text(panel, operator, "-20 to 61 mm")
    # A node that was just started takes no motion before it is sure of the machine.
    panel.wait_for_state(operator, "idle")
    operator.click(button("run"))
    wait_for_text(panel, operator, "waiting: line 5 of 8")
    other = panel.open(chromium.new_page())
    other.click(tab("Program"))
    wait_for_text(panel, other, "waiting: line 5 of 8")
    panel.click_for_words(other, button("go on"), "nothing done, as the controls", "refusal")
    wait_for_text(panel, other, "waiting: line 5 of 8")
    other.click(button("stop"))
    wait_for_text(panel, other, "ended: line 5 of 8")
