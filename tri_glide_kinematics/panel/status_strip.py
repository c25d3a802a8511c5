"""What stands above the page, whatever tab is open: the strip, and who has the controls."""

from __future__ import annotations

from dataclasses import dataclass

import viser

from tri_glide_kinematics.panel.operator_requests import Controls, Event, OperatorRequests, name_of


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


class PagesBar:
    """Buttons with which a page takes, asks for, and gives up the controls."""

    def __init__(self, gui: viser.GuiApi, requests: OperatorRequests) -> None:
        """Add them to the open container of ``gui``."""
        group = gui.add_button_group("Controls", ("take", "give up"))

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
