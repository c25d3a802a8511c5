"""A machine as MJCF, the language of MuJoCo: six rods whose lower ends are tied to the platform.

Each rod has its two joints at the carriage. The platform is free, and is held by six constraints
(``equality/connect``): the two rods of each arm keep it from turning, as they do in the machine.
The model begins with closed loops: each joint has a reference value, at which its body is as
written.
"""

from __future__ import annotations

from math import cos, pi, sin
from xml.etree.ElementTree import Comment, Element, indent, tostring

from tri_glide_kinematics.description.machine import RODS, SIDES, MachineDescription, add
from tri_glide_kinematics.dynamics import Arm, Masses
from tri_glide_kinematics.vectors import Vector3

# Taken where no masses are known.
NOMINAL_MASSES = Masses.uniform(carriage=1.0, arm=0.1, platform=0.3)

# A moving body needs a mass and inertias [kg], [kg m^2]. No rod turns about its own axis.
LEAST_MASS, LEAST_INERTIA = 1e-9, 1e-13

TIME_STEP = 0.0005  # s
# The constraints give way a little; they come back in this time [s], as a part of the time step.
RETURN_TIME = 4.0
# Of a drive with all that it could move [Hz].
DRIVE_FREQUENCY = 30.0


def mjcf_text(
    description: MachineDescription,
    masses: Masses | None = None,
    heights: Vector3 | None = None,
) -> str:
    """Return a machine as MJCF, its last line ended.

    Args:
        description: of the machine.
        masses: None for ``NOMINAL_MASSES``.
        heights: of the sliders at the start, as the drives report them; None for the middle of the
            travel. Shape (3,) [m].

    Raises:
        NoPoseError: if the arms do not meet at these heights.
    """
    masses = masses or NOMINAL_MASSES
    heights = heights or description.middle
    position = description.machine.forward(description.true_heights(heights))
    root = Element("mujoco", model="tri_glide")
    root.append(Comment(" Made by describe_machine. "))
    add(root, "compiler", angle="radian")
    add(root, "option", gravity=masses.gravity, timestep=TIME_STEP, integrator="implicitfast")
    default = add(root, "default")
    add(default, "geom", contype="0", conaffinity="0")
    solref = (RETURN_TIME * TIME_STEP, 1.0)
    add(default, "equality", solref=solref, solimp="0.999 0.9999 0.001")
    world = add(root, "worldbody")
    add(world, "light", pos="0 0 3", dir="0 0 -1", directional="true")
    equality = add(root, "equality")
    actuator = add(root, "actuator")
    for arm in range(3):
        _add_column(world, description, arm)
        _add_arm(world, description, masses, arm, heights[arm], position)
        end = (0.0, 0.0, -description.parts.arm_lengths[arm])
        for rod in _rods(arm):
            platform = description.platform_frame
            add(equality, "connect", name=rod, body1=rod, body2=platform, anchor=end)
        if masses.counterweights[arm] > 0.0:
            _add_counterweight(world, equality, description, masses, arm)
        _add_drive(actuator, description, masses, arm)
    _add_platform(world, description, masses, position)
    add(add(root, "keyframe"), "key", name="start", ctrl=heights)
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def _rods(arm: int) -> tuple[str, ...]:
    return RODS[len(SIDES) * arm : len(SIDES) * (arm + 1)]


def _add_column(world: Element, description: MachineDescription, arm: int) -> None:
    parts = description.parts
    bottom, top = description.column_ends(arm)
    half = 0.5 * parts.size
    size = (half, half, 0.5 * (top - bottom))
    place = (*parts.column(arm), 0.5 * (bottom + top))
    turn = (0.0, 0.0, parts.azimuth(arm))
    add(world, "geom", type="box", size=size, pos=place, euler=turn, rgba="0.47 0.49 0.53 1")


def _add_arm(
    world: Element,
    description: MachineDescription,
    masses: Masses,
    arm: int,
    height: float,
    position: Vector3,
) -> None:
    """Add a carriage and its two rods, at a reported height and a position of the platform [m]."""
    parts, name = description.parts, description.joint_names[arm]
    true = height + description.height_offsets[arm]
    place, turn = (*parts.towers[arm], true), (0.0, 0.0, parts.azimuth(arm))
    carriage = add(world, "body", name=f"carriage_{arm + 1}", pos=place, euler=turn)
    add(
        carriage,
        "joint",
        name=name,
        type="slide",
        axis="0 0 1",
        ref=height,
        range=(description.lower_heights[arm], description.upper_heights[arm]),
        damping=masses.viscous[arm],
        frictionloss=masses.coulomb[arm],
    )
    _add_point(carriage, masses.carriages[arm])
    size = parts.size
    box = (1.2 * size, 1.2 * size, size)
    add(carriage, "geom", type="box", size=box, rgba="0.78 0.47 0.08 1")
    swing, tilt = parts.swing_and_tilt(arm, true, position)
    turned = (
        cos(0.5 * swing) * cos(0.5 * tilt),
        sin(0.5 * swing) * cos(0.5 * tilt),
        cos(0.5 * swing) * sin(0.5 * tilt),
        sin(0.5 * swing) * sin(0.5 * tilt),
    )
    for rod, along in zip(_rods(arm), parts.rod_places):
        body = add(carriage, "body", name=rod, pos=(along, 0.0, 0.0), quat=turned)
        # The axis across the arm, as it is seen from the rod at the start.
        axis = (cos(tilt), 0.0, sin(tilt))
        add(body, "joint", name=f"{rod}_swing", type="hinge", axis=axis, ref=swing)
        add(body, "joint", name=f"{rod}_tilt", type="hinge", axis="0 1 0", ref=tilt)
        _add_rod(body, masses.arms[arm], parts.arm_lengths[arm], parts.rod_radius)


def _add_rod(body: Element, arm: Arm, length: float, radius: float) -> None:
    """Add mass and shape of one of the two rods of an ``arm``."""
    both = arm.mass * length * length / 12.0 if arm.inertia is None else arm.inertia
    inertia = max(0.5 * both, LEAST_INERTIA)
    inertias = (inertia, inertia, LEAST_INERTIA)
    centre, end = (0.0, 0.0, -arm.centre * length), (0.0, 0.0, -length)
    add(body, "inertial", pos=centre, mass=max(0.5 * arm.mass, LEAST_MASS), diaginertia=inertias)
    line = (0.0, 0.0, 0.0, *end)
    add(body, "geom", type="capsule", size=radius, fromto=line, rgba="0.16 0.18 0.22 1")
    add(body, "site", name=f"{body.get('name')}_end", pos=end)


def _add_platform(
    world: Element, description: MachineDescription, masses: Masses, position: Vector3
) -> None:
    parts, mass = description.parts, masses.platform + masses.payload
    platform = add(world, "body", name=description.platform_frame, pos=position)
    add(platform, "freejoint", name="platform")
    radius, half = parts.platform_radius, 0.25 * parts.size
    along = 0.5 * mass * radius * radius
    across = 0.5 * along + mass * half * half / 3.0
    add(platform, "inertial", pos="0 0 0", mass=mass, diaginertia=(across, across, along))
    add(platform, "geom", type="cylinder", size=(radius, half), rgba="0.12 0.47 1 1")
    for arm in range(3):
        (x, y), (ax, ay) = parts.platform_joints[arm], parts.across[arm]
        for rod, along in zip(_rods(arm), parts.rod_places):
            add(platform, "site", name=f"{rod}_joint", pos=(x + along * ax, y + along * ay, 0.0))


def _add_counterweight(
    world: Element, equality: Element, description: MachineDescription, masses: Masses, arm: int
) -> None:
    """Add a mass that sinks as its carriage rises."""
    name, mass = f"counterweight_{arm + 1}", masses.counterweights[arm]
    place = (*description.parts.column(arm), description.column_ends(arm)[0])
    body = add(world, "body", name=name, pos=place)
    add(body, "joint", name=name, type="slide", axis="0 0 1")
    _add_point(body, mass)
    slider = description.joint_names[arm]
    add(equality, "joint", name=name, joint1=name, joint2=slider, polycoef="0 -1 0 0 0")


def _add_point(body: Element, mass: float) -> None:
    """Add the mass of a body that never turns, so its inertia has no effect."""
    add(body, "inertial", pos="0 0 0", mass=mass, diaginertia=3 * (1e-3 * mass,))


def _add_drive(
    actuator: Element, description: MachineDescription, masses: Masses, arm: int
) -> None:
    """Add a drive that holds its setpoint as a spring and a damper do."""
    moved = masses.carriages[arm] + masses.counterweights[arm] + masses.arms[arm].mass
    moved += masses.platform + masses.payload
    rate = 2.0 * pi * DRIVE_FREQUENCY
    name = description.joint_names[arm]
    stiffness, damping = moved * rate * rate, 2.0 * moved * rate
    travel = (description.lower_heights[arm], description.upper_heights[arm])
    add(actuator, "position", name=name, joint=name, kp=stiffness, kv=damping, ctrlrange=travel)
