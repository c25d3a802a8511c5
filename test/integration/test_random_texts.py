"""Probe, panel and drive do not read what is meant for people.

They pass their tests with an ik_node whose texts are random letters: those of its states, and those
of the results of goals. Tests of what people read are left out.
"""

import re

import pytest
from integration import test_calibration_node as probing
from integration import test_drive as driving
from integration import test_panel_texts as panels
from integration.test_calibration_node import shared_calibration
from integration.test_drive import drive
from integration.test_panel_texts import first, page, second

from testing.random_texts import VARIABLE

__all__ = ["drive", "first", "page", "second", "shared_calibration"]


@pytest.fixture(scope="module", autouse=True)
def random_texts():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, "1")
        yield


def is_random(machine):
    last = machine.states[-1]
    texts = (last.reason, last.refusal_text, last.target_text, last.remark)
    return all(re.fullmatch("[a-z]{12}", text) for text in texts)


class TestProbe:
    started = probing.TestOneMachine.started
    test_plate = probing.TestOneMachine.test_a_probe_finds_the_plate_and_comes_back

    def test_the_texts_were_random(self, started):
        assert is_random(started.machine)


class TestDrive:
    @pytest.fixture(autouse=True)
    def randomly(self, running_machine):
        yield
        assert is_random(running_machine)

    test_interrupted = staticmethod(driving.test_ctrl_c_lets_the_platform_rest_on_its_path)

    def test_it_goes_on_after_a_success_and_ends_at_a_refusal(self, drive):
        steps = [(0.0, 0.0, 0.3), (0.5, 0.0, 0.25), (0.0, 0.0, 0.3)]
        command = drive([{"move": {"to": list(step)}} for step in steps])
        assert command.end() == 1
        assert [row[2] for row in command.rows()] == ["succeeded", "refused", "not"]


class TestPanel:
    pytestmark = panels.pytestmark

    test_steps = staticmethod(panels.test_steps_add_up)
    test_pause = staticmethod(panels.test_points_are_taught_driven_paused_and_saved)
    test_stop = staticmethod(panels.test_a_second_page_cannot_take_the_controls_unasked)
    test_hold = staticmethod(panels.test_a_page_that_is_cut_off_ends_its_jog_and_loses_the_controls)

    def test_the_texts_were_random(self, panel):
        assert is_random(panel.machine)
