"""Draws ``docs/images/your_machine.png``: ``python docs/sketch.py`` from the root of the clone."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from tri_glide_kinematics import TriGlide, TriGlideGeometry

matplotlib.use("Agg")

IMAGE = Path(__file__).parent / "images" / "your_machine.png"
BASE_RADIUS, PLATFORM_RADIUS, ARM_LENGTH = 0.25, 0.05, 0.40
LOWER, UPPER = 0.3, 0.9
TURNED = math.radians(20.0)
PLATFORM = (0.0, 0.0, 0.2)
RED, BLUE, GREY = "tab:red", "tab:blue", "0.6"

Point = tuple[float, float]


def machine(orientation: float = 0.0) -> TriGlideGeometry:
    """Return the default machine, turned by ``orientation`` [rad]."""
    return TriGlideGeometry.symmetric(BASE_RADIUS, PLATFORM_RADIUS, ARM_LENGTH, orientation)


def towers(geometry: TriGlideGeometry) -> list[Point]:
    """Return the places of the tower joints: anchors are shorter by the platform's radius [m]."""
    factor = BASE_RADIUS / (BASE_RADIUS - PLATFORM_RADIUS)
    return [(factor * x, factor * y) for x, y in geometry.anchors]


def arrow(axes: Axes, start: Point, end: Point, colour: str = "black", style: str = "->") -> None:
    """Draw an arrow, or with another style a dimension."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": style, "color": colour, "lw": 1.3})


def from_above(axes: Axes) -> None:
    """Draw towers, arms and platform in x and y, and the first tower of a turned machine."""
    axes.set_title("seen from above (z points at you)")
    axes.add_patch(Circle((0.0, 0.0), BASE_RADIUS, fill=False, ls=":", color=GREY))
    axes.add_patch(Circle((0.0, 0.0), PLATFORM_RADIUS, fill=False, ls=":", color=GREY))
    part = PLATFORM_RADIUS / BASE_RADIUS
    places = towers(machine())
    joints = [(part * x, part * y) for x, y in places]
    axes.fill(*zip(*joints), color=BLUE, alpha=0.35)
    for number, ((x, y), (joint_x, joint_y)) in enumerate(zip(places, joints), 1):
        axes.plot([joint_x, x], [joint_y, y], color=BLUE, lw=2.5)
        axes.plot(x, y, "s", color="black", ms=13)
        axes.text(1.2 * x, 1.2 * y, f"tower {number}", ha="center", va="center", weight="bold")
    x, y = towers(machine(TURNED))[0]
    axes.plot(x, y, "s", color=RED, ms=13, fillstyle="none")
    axes.plot([0.0, x], [0.0, y], color=RED, ls="--", lw=1.0)
    arc = [math.radians(90.0) + TURNED * k / 20 for k in range(21)]
    axes.plot([0.18 * math.cos(a) for a in arc], [0.18 * math.sin(a) for a in arc], color=RED)
    arrow(
        axes,
        (0.18 * math.cos(arc[-3]), 0.18 * math.sin(arc[-3])),
        (0.18 * math.cos(arc[-1]), 0.18 * math.sin(arc[-1])),
        RED,
    )
    axes.text(-0.13, 0.25, "orientation > 0\nturns all towers\nthis way", color=RED, ha="right")
    arrow(axes, (0.0, 0.0), (0.14, 0.0))
    axes.text(0.15, 0.0, "x", va="center", style="italic", size=13)
    arrow(axes, (0.0, 0.0), (0.0, 0.14))
    axes.text(0.012, 0.12, "y", style="italic", size=13)
    for radius, angle, name, place in (
        (BASE_RADIUS, math.radians(35.0), "base_radius", (0.22, 0.18)),
        (PLATFORM_RADIUS, math.radians(-90.0), "platform_radius", (-0.06, -0.10)),
    ):
        end = (radius * math.cos(angle), radius * math.sin(angle))
        arrow(axes, (0.0, 0.0), end, "0.45")
        axes.text(*place, name, color="0.35", va="center")
    axes.set_xlim(-0.36, 0.36)
    axes.set_ylim(-0.27, 0.36)


def from_the_side(axes: Axes) -> None:
    """Draw tower 1 and the platform in y and z."""
    axes.set_title("seen along the x axis: tower 1, the others left out")
    height = TriGlide(machine()).inverse(PLATFORM)[0]
    z = PLATFORM[2]
    tower = BASE_RADIUS
    axes.axhline(0.0, color="black", lw=1.0)
    axes.text(-0.19, -0.035, "z = 0, and height 0 of every slider", ha="left")
    axes.plot([tower, tower], [0.0, 0.98], color=GREY, lw=7, solid_capstyle="butt")
    for end, name in ((LOWER, "lower_heights"), (UPPER, "upper_heights")):
        axes.plot([tower - 0.03, tower + 0.03], [end, end], color="black", lw=1.5)
        axes.text(tower + 0.04, end, name, va="center")
    axes.plot([PLATFORM_RADIUS, tower], [z, height], "o-", color=BLUE, lw=2.5, ms=8)
    axes.text(0.10, 0.43, "arm_length", color=BLUE, ha="right")
    axes.plot(tower, height, "s", color="black", ms=15)
    axes.text(tower + 0.04, height + 0.03, "slider 1", weight="bold", va="center")
    axes.plot([-PLATFORM_RADIUS, PLATFORM_RADIUS], [z, z], color=BLUE, lw=7, alpha=0.5)
    axes.plot(0.0, z, "o", color=RED, ms=8)
    axes.text(-0.03, z + 0.035, "platform centre (x, y, z)", color=RED, ha="right")
    arrow(axes, (0.0, 0.0), (0.0, z - 0.01), RED, "<->")
    axes.text(-0.012, 0.45 * z, "z", color=RED, ha="right", style="italic", size=13)
    arrow(axes, (0.58, 0.0), (0.58, height), "black", "<->")
    axes.plot([tower + 0.03, 0.60], [height, height], color="black", lw=0.6, ls=":")
    axes.text(0.59, 0.12, "height of slider 1\n(position in JointState)")
    arrow(axes, (-0.18, 0.62), (-0.08, 0.62))
    axes.text(-0.07, 0.62, "y", va="center", style="italic", size=13)
    arrow(axes, (-0.18, 0.62), (-0.18, 0.72))
    axes.text(-0.18, 0.73, "z, up", ha="center", style="italic", size=13)
    axes.set_xlim(-0.32, 0.90)
    axes.set_ylim(-0.07, 1.0)


def main() -> None:
    """Draw both views."""
    figure = Figure(figsize=(12.0, 5.6), layout="constrained")
    above, side = figure.subplots(1, 2)
    from_above(above)
    from_the_side(side)
    for axes in (above, side):
        axes.set_aspect("equal")
        axes.axis("off")
    figure.savefig(IMAGE, dpi=90)


if __name__ == "__main__":
    main()
