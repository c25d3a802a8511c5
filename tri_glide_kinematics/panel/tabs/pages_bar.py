"""The line that says who has the controls, and the buttons to take and to give them."""

from __future__ import annotations

import viser

from tri_glide_kinematics.panel.tabs.controls import Controls, name_of
from tri_glide_kinematics.panel.tabs.operator_requests import Desk, Event


class PagesBar:
    """Buttons with which a page takes, asks for, and gives up the controls."""

    def __init__(self, gui: viser.GuiApi, desk: Desk) -> None:
        """Add them to the open container of ``gui``."""
        group = gui.add_button_group("Controls", ("take", "give up"))

        async def on_click(event: Event) -> None:
            page = event.client_id
            if event.target.value == "give up":
                desk.give(page)
            else:
                desk.controls.ask(page)

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
