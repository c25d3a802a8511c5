"""The table of numbers on the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.machine_facts import MachineFacts
from tri_glide_kinematics.panel.markup import bar, table
from tri_glide_kinematics.panel.scene import Pose
from tri_glide_kinematics.vectors import Vector3

# A bar is coloured from this part of its limit on.
MUCH = 0.9

# How far the edge is looked for [m].
FARTHEST = 10.0

AXES: tuple[Vector3, ...] = (
    (1.0, 0.0, 0.0),
    (-1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (0.0, -1.0, 0.0),
    (0.0, 0.0, 1.0),
    (0.0, 0.0, -1.0),
)
NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")

# What it is, how much, and a bar or a word beside it.
Row = tuple[str, str, str]


@dataclass(frozen=True)
class EdgeDistance:
    """How far the platform may go along the axes.

    Attributes:
        distance: in the direction in which the edge is nearest [m].
        direction: which that is.
    """

    distance: float
    direction: str


def edge_distance(facts: MachineFacts, position: Vector3) -> EdgeDistance:
    """Return how far the edge of the workspace is along the nearest of the six directions."""
    workspace = facts.workspace
    distances = [workspace.exit_distance(position, axis, FARTHEST) for axis in AXES]
    nearest = min(range(len(AXES)), key=distances.__getitem__)
    return EdgeDistance(distances[nearest], NAMES[nearest])


def edge_row(facts: MachineFacts, position: Vector3) -> Row:
    """Return how far the edge is, as a row of the table; 0 mm outside. It takes milliseconds."""
    edge = edge_distance(facts, position)
    return "edge", f"{1000.0 * edge.distance:.1f} mm", edge.direction


def numbers_table(
    facts: MachineFacts,
    pose: Pose,
    edge: Row,
    velocities: Sequence[float] | None,
    late_cycles: str,
) -> str:
    """Return the numbers as a table for the page.

    Args:
        facts: of the machine.
        pose: as it is measured.
        edge: the row that tells how far it is to the edge.
        velocities: of the sliders, as they are commanded; None if they are not known [m/s].
        late_cycles: of ``ik_node``, as it tells them.
    """
    rows = [(axis, f"{1000.0 * part:.2f} mm", "") for axis, part in zip("xyz", pose.position)]
    lower, upper = facts.travel
    scaled = [facts.speed_scale * limit for limit in facts.limits.velocity]
    for index, name in enumerate(facts.joints):
        height = pose.heights[index]
        part = (height - lower[index]) / (upper[index] - lower[index])
        rows.append((f"{name} height", f"{1000.0 * height:.2f} mm", bar(part)))
        if velocities is not None:
            part = abs(velocities[index]) / scaled[index]
            rows.append(
                (
                    f"{name} velocity",
                    f"{1000.0 * velocities[index]:.1f} mm/s",
                    bar(part, is_much=part > MUCH),
                )
            )
    try:
        condition = facts.machine.condition_number(pose.position)
        limit = facts.values["max_condition_number"]
        used = bar(condition / limit, is_much=condition > MUCH * limit)
        rows.append(("condition number", f"{condition:.2f}", used))
    except KinematicsError as error:
        rows.append(("condition number", "", str(error)))
    rows.append(edge)
    rows.append(("speed scale", f"{100.0 * facts.speed_scale:.0f} %", ""))
    rows.append(("late cycles", late_cycles, ""))
    return table(rows)
