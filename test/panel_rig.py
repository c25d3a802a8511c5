"""Parts of the panel on a page server without a browser, and what two pages do to them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rclpy.context import Context
from rclpy.serialization import serialize_message
from viser import GuiEvent, ViserServer

from testing.client import Probe
from testing.waiting import wait_until
from tri_glide_interfaces.msg import MachineState, MotionState
from tri_glide_kinematics.panel.link import MachineFacts, MachineLink
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.programs import ChosenProgram, ProgramFolder
from tri_glide_kinematics.panel.tabs import Runs
from tri_glide_kinematics.settings import IK_NODE

# The first page has the controls.
OPERATOR, OTHER = 0, 1
FACTS = MachineFacts({parameter.name: parameter.default for parameter in IK_NODE})


class DrivenMachine:
    """Takes the place of the machine of a tab, and notes where that sends it.

    Attributes:
        asked: what was asked for last: positions, or steps without their signs [m], and speeds
            [m/s]; None for nothing.
        facts: that are known of it.
        measured_position, commanded_position: where it is [m].
    """

    def __init__(self, requests: OperatorRequests) -> None:
        self.link, self.requests = requests.link, requests
        self.asked: Any = None
        self.facts: MachineFacts | None = FACTS
        self.measured_position = self.commanded_position = (0.0, 0.0, 0.25)

    def _note(self, *asked: Any) -> None:
        self.asked = asked

    move_to = follow = _note

    def move_by(self, step: Any, speed: float) -> None:
        self.asked = [abs(part) for part in step], speed


class PanelRig:
    """Requests of two pages, on real topics, and the fields and buttons that they show."""

    def __init__(self, context: Context, server: ViserServer, namespace: str) -> None:
        self.probe = Probe(context, namespace, "panel")
        self.server, self.gui = server, server.gui
        self.requests = OperatorRequests(MachineLink(self.probe.node), server)
        for page in (OPERATOR, OTHER):
            self.requests.controls.opened(page)
        self.machine: Any = DrivenMachine(self.requests)

    def handle(self, words: str) -> Any:
        """Return the newest field or button with a label, or the group with a button, of words."""
        return next(
            each
            for each in reversed(tuple(self.gui._gui_input_handle_from_uuid.values()))
            if words in (each._impl.props.label, *getattr(each._impl.props, "options", ()))
        )

    def press(self, words: str, value: Any = None, page: int = OPERATOR) -> Any:
        """Press a button, or give a field a ``value``, as a page does; return what was pressed."""
        handle = self.handle(words)
        if value is None and words in getattr(handle._impl.props, "options", ()):
            value = words
        return self.send(handle, True if value is None else value, page)

    def send(self, handle: Any, value: Any, page: int = OPERATOR) -> Any:
        """Do what a page does when a field, or a button, gets a ``value``."""
        handle._impl.value = value
        for callback in handle._impl.update_cb:
            asyncio.run(callback(self.event(handle, page)))
        self.requests.fulfil()
        return handle

    @staticmethod
    def event(handle: Any, page: int = OPERATOR) -> Any:
        """Return what viser tells of an action of a page."""
        return GuiEvent(None, page, handle)  # type: ignore[arg-type]


class ProgramRig:
    """What runs programs, beside a tab; the settings have a work offset.

    Attributes:
        words: all that the tab tells.
    """

    words = ""

    def __init__(self, rig: PanelRig, machine: Any, folder: Path) -> None:
        self.rig, self.machine, self.requests, self.press = rig, machine, rig.requests, rig.press
        self.folder = ProgramFolder(folder / "programs")
        self.folder.folder.mkdir()
        self.zeros = folder / "zeros.yaml"
        settings = folder / "settings.yaml"
        settings.write_text("unit: mm\noffsets: {G54: [0, 0, 0]}\n")
        self.chosen = ChosenProgram(self.folder, settings, self.zeros, machine)
        self.runs = Runs(rig.requests)

    @property
    def refusal(self) -> str:
        return self.requests.refusal

    def wait_for(self, condition: Callable[[], Any]) -> None:
        wait_until(condition, lambda: f"{self.words}; {self.refusal}", 0.02)


HOME = (0.0, 0.0, 0.25)
REST = (0.0, 0.0, 0.0)


def tell(machine: ShownMachine, **values: Any) -> None:
    """Let a machine tell its state, idle unless ``values`` say another one, and where it is."""
    state: dict[str, Any] = {"state": MachineState.IDLE, "cause": MachineState.CAUSE_ENABLE_ASKED}
    message = MachineState(**{**state, **values})
    message.position.z = HOME[2]
    machine.feeds._on_state(message)
    heights = FACTS.machine.inverse(HOME)
    motion = MotionState(
        commanded_heights=heights,
        commanded_velocities=REST,
        commanded_accelerations=REST,
        measured_heights=heights,
    )
    machine.feeds.motion.subscription.callback(serialize_message(motion))
    machine.step()


def known_machine(rig: PanelRig) -> ShownMachine:
    """Return the machine at rest in its middle, as its ``ik_node`` has told it."""
    machine = ShownMachine(rig.probe.node, rig.requests)
    machine._take(FACTS)
    tell(machine)
    return machine
