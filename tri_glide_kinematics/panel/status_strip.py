"""What stands above the page, whatever tab is open: the strip, and who has the controls."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import viser

from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.operator_requests import Event, OperatorRequests
from tri_glide_kinematics.panel.operators import Controls, name_of
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.words import FAULT, WARNING


@dataclass(frozen=True)
class Strip:
    """The line above the page.

    Attributes:
        color: ready, motion, warning or fault.
        state: in a word.
        reason: of the state.
        refusal: what was refused last, and why; empty for nothing.
        pages: who has the controls.
        stop: what stands below Stop.
        position: of the platform.
        speed: of the platform, and what changes it.
        left: the way and the time to the end of what is done.
        limit: whether the teach mode is on, and how fast the platform may be.
        controls: whether the page has them.
    """

    color: str
    state: str
    reason: str
    refusal: str = ""
    pages: str = ""
    stop: str = ""
    position: str = ""
    speed: str = ""
    left: str = ""
    limit: str = ""
    controls: bool = False


def strip_of(
    page: int,
    requests: OperatorRequests,
    machine: ShownMachine,
    *,
    notice: str = "",
    work: str = "",
    left: str = "",
) -> Strip:
    """Return what stands above a ``page``.

    Args:
        page: its number.
        requests: of the operator.
        machine: that is shown.
        notice: which nodes have ended.
        work: where the platform is from the work zero.
        left: how long a program still takes.
    """
    controls, status = requests.controls, machine.feeds.status
    about = requests.refusal, pages_text(controls, page)
    has_controls = controls.holder == page
    if machine.is_heard:
        return Strip(
            WARNING if notice and status.color != FAULT else status.color,
            status.word,
            _joined(notice, machine.reason),
            *about,
            "ramps to rest (Esc)",
            (status.position or machine.measured_text) + work,
            status.speed,
            left or status.left,
            status.speed_limit,
            has_controls,
        )
    server = machine.link.server
    if machine.facts is None:
        state, reason = "no machine", f"nobody answers as {server}"
    else:
        state, reason = "not heard", f"{server} was {status.word} and tells no more"
    return Strip(
        *(WARNING, state, _joined(notice, reason), *about, "not heard"),
        position=machine.measured_text + work,
        controls=has_controls,
    )


def _joined(notice: str, reason: str) -> str:
    return "; ".join(filter(None, (notice, reason)))


NOTICE_PERIOD = 0.5  # s between two looks into its file
LONGEST_NOTICE = 500  # characters


class Notice:
    """Which nodes have ended, as the command ``panel`` tells it, and a button to start them again.

    Attributes:
        text: in words; empty for none.
    """

    def __init__(self, requests: OperatorRequests, file: Path | None, wish: Path | None) -> None:
        """Add the button, unseen, to the open container of the page.

        The command writes the ``file``, and starts the nodes when there is a file ``wish``; None is
        for a panel that it has not started.
        """
        self.text = ""
        self._requests = requests
        self._file, self._wish = file, wish
        self._pace = Pace(NOTICE_PERIOD)
        self._button = requests.button(
            "Start again what has ended",
            self._ask,
            color="orange",
            icon=viser.Icon.REFRESH,
            visible=False,
        )

    def look(self) -> None:
        """Read it now and then, and tell what is new."""
        if self._file is None or not self._pace.is_due():
            return
        # Nobody has anything to say before it is there.
        with suppress(OSError):
            text = self._file.read_text(encoding="utf-8", errors="replace")
            text = text[:LONGEST_NOTICE].strip()
            if text != self.text:
                self.text = text
                self._requests.history.add(WARNING, text or "all nodes run again")
                self._button.visible = bool(text) and self._wish is not None

    def _ask(self) -> None:
        """Ask for a start, if one may be asked for."""
        if self._wish is None:
            return
        try:
            self._wish.touch()
        except OSError as error:
            self._requests.refuse(f"nothing started: {error.strerror or error}")


class PagesBar:
    """Buttons with which a page takes, asks for, and gives up the controls."""

    def __init__(self, requests: OperatorRequests) -> None:
        """Add them to the open container of the page."""
        group = requests.gui.add_button_group("Controls", ("take", "give up"))

        async def on_click(event: Event) -> None:
            page = event.client_id
            if event.target.value == "give up":
                requests.give(page)
            else:
                requests.controls.ask(page)

        group.on_click(on_click)


def pages_text(controls: Controls, page: int) -> str:
    """Return what a ``page`` is told about the others; empty if it is alone and in control."""
    holder, others = controls.holder, len(controls.pages) - 1
    if holder is None:
        return "nobody has the controls: take them here (Stop always works)"
    if holder == page:
        asking = ", ".join(name_of(each) for each in controls.asking)
        if asking:
            return f"{asking} asks for the controls: give them up for that"
        return f"you have the controls; {_pages(others)} looking on" if others else ""
    asked = " (asked for)" if page in controls.asking else ""
    return f"you are {name_of(page)}; {name_of(holder)} has the controls{asked} (Stop always works)"


def _pages(count: int) -> str:
    return "1 other page is" if count == 1 else f"{count} other pages are"
