"""The part of a file of measurements that says where the platform may be.

The keys are those of the parameters of ``ik_node``; box and cylinder may be left out:

    workspace:
      lower_heights: [300, 300, 300]
      upper_heights: [900, 900, 900]
      reach_margin: 5
      max_condition_number: 6
      box_lower: [-100, -100, 0]
      box_upper: [100, 100, 500]
      cylinder_center: [0, 0]
      cylinder_radius: 120
      cylinder_z: [0, 500]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from tri_glide_kinematics.keys import Keys
from tri_glide_kinematics.workspace.limits import Cylinder, WorkspaceLimits

NONE = "none"


def read_workspace(section: Keys, unit: float) -> WorkspaceLimits:
    """Return the limits, with the travel as the drives report it.

    Args:
        section: the keys.
        unit: of all lengths in it [m].

    Raises:
        KinematicsError: if a key is missing or a number has no meaning.
    """

    def lengths(key: str, count: int) -> tuple[float, ...]:
        return tuple(unit * value for value in section.numbers(key, section.value(key), count))

    def given(key: str) -> bool:
        return bool(section.value(key, NONE) != NONE)

    def vector(key: str) -> tuple[float, float, float]:
        x, y, z = lengths(key, 3)
        return x, y, z

    cylinder = None
    if given("cylinder_center"):
        x, y = lengths("cylinder_center", 2)
        lower, upper = lengths("cylinder_z", 2)
        cylinder = Cylinder(x, y, unit * section.number("cylinder_radius"), lower, upper)
    return WorkspaceLimits(
        vector("lower_heights"),
        vector("upper_heights"),
        unit * section.number("reach_margin"),
        section.number("max_condition_number"),
        vector("box_lower") if given("box_lower") else None,
        vector("box_upper") if given("box_upper") else None,
        cylinder,
    )


def workspace_keys(
    limits: WorkspaceLimits, lengths: Callable[[Iterable[float]], list[float]]
) -> dict[str, Any]:
    """Return what ``read_workspace`` reads as these ``limits``.

    Args:
        limits: with the travel as the drives report it.
        lengths: brings some [m] into the unit of the file.
    """
    keys: dict[str, Any] = {
        "lower_heights": lengths(limits.lower_heights),
        "upper_heights": lengths(limits.upper_heights),
        "reach_margin": lengths([limits.reach_margin])[0],
        "max_condition_number": limits.max_condition_number,
    }
    if limits.box_lower is not None:
        keys["box_lower"] = lengths(limits.box_lower)
    if limits.box_upper is not None:
        keys["box_upper"] = lengths(limits.box_upper)
    cylinder = limits.cylinder
    if cylinder is not None:
        keys["cylinder_center"] = lengths([cylinder.center_x, cylinder.center_y])
        keys["cylinder_radius"] = lengths([cylinder.radius])[0]
        keys["cylinder_z"] = lengths([cylinder.z_min, cylinder.z_max])
    return keys
