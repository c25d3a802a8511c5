"""The picture of the demonstration: what the sliders were told and where the platform was."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tri_glide_kinematics.demo.client import MachineSettings
from tri_glide_kinematics.demo.leg import Leg
from tri_glide_kinematics.figures import Mark, Span, motion_figure
from tri_glide_kinematics.motion.limit_use import CommandStream
from tri_glide_kinematics.picture_commands import save_figure
from tri_glide_kinematics.vectors import FloatArray

TARGET_STYLE = {"marker": "o", "color": "tab:red", "markersize": 4}
START_STYLE = {"marker": "^", "color": "tab:green", "markersize": 7, "markerfacecolor": "none"}
END_STYLE = {"marker": "s", "color": "tab:green", "markersize": 6, "markerfacecolor": "none"}


def save_picture(
    folder: Path,
    legs: Sequence[Leg],
    path: FloatArray,
    stream: CommandStream,
    settings: MachineSettings,
) -> Path:
    """Draw the motion and return the path of the picture.

    Args:
        folder: is made if there is none.
        legs: in their order.
        path: measured positions of the platform. Shape (m, 3) [m].
        stream: all commands.
        settings: of the machine.
    """
    marks, spans = [], []
    for before, leg in zip((None, *legs), legs):
        if leg.target:
            marks.append(Mark(leg.name, leg.target, TARGET_STYLE))
        else:
            if before:
                marks.append(Mark(f"{leg.name} starts", before.reached, START_STYLE))
            marks.append(Mark(f"{leg.name} ends", leg.reached, END_STYLE))
        if leg.target is None or leg.tolerance:
            spans.append(_span(leg, stream))
    figure = motion_figure(stream, path, settings.limits, settings.travel, marks, spans)
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / "demo.png"
    save_figure(figure, picture, 110)
    return picture


def _span(leg: Leg, stream: CommandStream) -> Span:
    last = min(leg.end, len(stream.times)) - 1
    return Span(leg.name, float(stream.times[leg.first]), float(stream.times[last]))
