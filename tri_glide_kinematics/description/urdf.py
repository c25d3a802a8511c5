"""A machine as URDF: a tree, as a URDF has no loops.

Carriages, rods and platform all hang on the base. Nothing in the file ties the lower end of a rod
to the platform: the values of the passive joints do (``Parts.passive_values``).
"""

from __future__ import annotations

from xml.etree.ElementTree import Comment, Element, indent, tostring

from tri_glide_kinematics.description.machine import RODS, SIDES, MachineDescription, add
from tri_glide_kinematics.vectors import Vector3

NOTE = (
    " Made by describe_machine. A URDF has no loops: fk_node publishes the values of all joints, "
    "those of the rods and of the platform too, on all_joint_states. "
)

COLOURS = {
    "column": (0.47, 0.49, 0.53, 1.0),
    "carriage": (0.78, 0.47, 0.08, 1.0),
    "rod": (0.16, 0.18, 0.22, 1.0),
    "platform": (0.12, 0.47, 1.0, 1.0),
}
ORIGIN: Vector3 = (0.0, 0.0, 0.0)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def urdf_text(description: MachineDescription) -> str:
    """Return a machine as URDF, its last line ended."""
    robot = Element("robot", name="tri_glide")
    robot.append(Comment(NOTE))
    for name, colour in COLOURS.items():
        add(add(robot, "material", name=name), "color", rgba=colour)
    _add_base(robot, description)
    for arm in range(3):
        _add_arm(robot, description, arm)
    _add_platform(robot, description)
    indent(robot)
    return tostring(robot, encoding="unicode", xml_declaration=True) + "\n"


def _add_base(robot: Element, description: MachineDescription) -> None:
    """Add what does not move: the columns."""
    base = add(robot, "link", name=description.base_frame)
    for arm in range(3):
        bottom, top = description.column_ends(arm)
        size = description.parts.size
        place = (*description.parts.column(arm), 0.5 * (bottom + top))
        turn = (0.0, 0.0, description.parts.azimuth(arm))
        _add_visual(base, "column", "box", place, turn, size=(size, size, top - bottom))


def _add_arm(robot: Element, description: MachineDescription, arm: int) -> None:
    """Add a carriage and its two rods."""
    parts, carriage = description.parts, f"carriage_{arm + 1}"
    size, length = parts.size, parts.arm_lengths[arm]
    link = add(robot, "link", name=carriage)
    _add_visual(link, "carriage", "box", size=(2.4 * size, 2.4 * size, 2.0 * size))
    slider = _add_joint(
        robot,
        description.joint_names[arm],
        "prismatic",
        (description.base_frame, carriage),
        Z,
        (*parts.towers[arm], description.height_offsets[arm]),
        (0.0, 0.0, parts.azimuth(arm)),
    )
    add(
        slider,
        "limit",
        lower=description.lower_heights[arm],
        upper=description.upper_heights[arm],
        velocity=description.velocities[arm],
        effort=description.forces[arm],
    )
    for side in range(len(SIDES)):
        rod = RODS[len(SIDES) * arm + side]
        hinge = f"{rod}_hinge"
        add(robot, "link", name=hinge)
        place = (parts.rod_places[side], 0.0, 0.0)
        _add_joint(robot, f"{rod}_swing", "continuous", (carriage, hinge), X, place)
        link = add(robot, "link", name=rod)
        middle = (0.0, 0.0, -0.5 * length)
        _add_visual(link, "rod", "cylinder", middle, radius=parts.rod_radius, length=length)
        _add_joint(robot, f"{rod}_tilt", "continuous", (hinge, rod), Y)


def _add_platform(robot: Element, description: MachineDescription) -> None:
    """Add the platform, on three axes that stand for its translation."""
    parts = description.parts
    lowest, highest = description.reach
    parent = description.base_frame
    for index, (axis, name) in enumerate(zip((X, Y, Z), "xyz")):
        child = description.platform_frame if name == "z" else f"platform_{name}_slide"
        link = add(robot, "link", name=child)
        joint = _add_joint(robot, f"platform_{name}", "prismatic", (parent, child), axis)
        # No drive moves it.
        add(joint, "limit", lower=lowest[index], upper=highest[index], velocity="0", effort="0")
        parent = child
    radius, thickness = parts.platform_radius, 0.5 * parts.size
    _add_visual(link, "platform", "cylinder", radius=radius, length=thickness)


def _add_visual(
    link: Element,
    material: str,
    kind: str,
    place: Vector3 = ORIGIN,
    turn: Vector3 = ORIGIN,
    **sizes: float | Vector3,
) -> None:
    visual = add(link, "visual")
    add(visual, "origin", xyz=place, rpy=turn)
    add(add(visual, "geometry"), kind, **sizes)
    add(visual, "material", name=material)


def _add_joint(
    robot: Element,
    name: str,
    kind: str,
    links: tuple[str, str],
    axis: Vector3,
    place: Vector3 = ORIGIN,
    turn: Vector3 = ORIGIN,
) -> Element:
    joint = add(robot, "joint", name=name, type=kind)
    add(joint, "origin", xyz=place, rpy=turn)
    for role, link in zip(("parent", "child"), links):
        add(joint, role, link=link)
    add(joint, "axis", xyz=axis)
    return joint
