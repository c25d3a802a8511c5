"""A machine as MJCF, the language of MuJoCo: six rods whose lower ends are tied to the platform.

Each rod has its two joints at the carriage. The platform is free, and is held by six constraints
(``equality/connect``): the two rods of each arm keep it from turning, as they do in the machine.
The model begins with closed loops: each joint has a reference value, at which its body is as
written.
"""

from __future__ import annotations

from math import cos, pi, sin
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from tri_glide_kinematics.description.machine import MachineDescription, numbers_text
from tri_glide_kinematics.description.parts import RODS, SIDES
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
    SubElement(root, "compiler", angle="radian")
    SubElement(
        root,
        "option",
        gravity=numbers_text(*masses.gravity),
        timestep=numbers_text(TIME_STEP),
        integrator="implicitfast",
    )
    default = SubElement(root, "default")
    SubElement(default, "geom", contype="0", conaffinity="0")
    SubElement(
        default,
        "equality",
        solref=numbers_text(RETURN_TIME * TIME_STEP, 1.0),
        solimp="0.999 0.9999 0.001",
    )
    world = SubElement(root, "worldbody")
    SubElement(world, "light", pos="0 0 3", dir="0 0 -1", directional="true")
    equality = SubElement(root, "equality")
    actuator = SubElement(root, "actuator")
    for arm in range(3):
        _add_column(world, description, arm)
        _add_arm(world, description, masses, arm, heights[arm], position)
        for rod in _rods(arm):
            SubElement(
                equality,
                "connect",
                name=rod,
                body1=rod,
                body2=description.platform_frame,
                anchor=numbers_text(0.0, 0.0, -description.parts.arm_lengths[arm]),
            )
        if masses.counterweights[arm] > 0.0:
            _add_counterweight(world, equality, description, masses, arm)
        _add_drive(actuator, description, masses, arm)
    _add_platform(world, description, masses, position)
    keyframe = SubElement(root, "keyframe")
    SubElement(keyframe, "key", name="start", ctrl=numbers_text(*heights))
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def _rods(arm: int) -> tuple[str, ...]:
    return RODS[len(SIDES) * arm : len(SIDES) * (arm + 1)]


def _add_column(world: Element, description: MachineDescription, arm: int) -> None:
    bottom, top = description.column_ends(arm)
    half = 0.5 * description.parts.size
    SubElement(
        world,
        "geom",
        type="box",
        size=numbers_text(half, half, 0.5 * (top - bottom)),
        pos=numbers_text(*description.parts.column(arm), 0.5 * (bottom + top)),
        euler=numbers_text(0.0, 0.0, description.parts.azimuth(arm)),
        rgba="0.47 0.49 0.53 1",
    )


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
    carriage = SubElement(
        world,
        "body",
        name=f"carriage_{arm + 1}",
        pos=numbers_text(*parts.towers[arm], true),
        euler=numbers_text(0.0, 0.0, parts.azimuth(arm)),
    )
    SubElement(
        carriage,
        "joint",
        name=name,
        type="slide",
        axis="0 0 1",
        ref=numbers_text(height),
        range=numbers_text(description.lower_heights[arm], description.upper_heights[arm]),
        damping=numbers_text(masses.viscous[arm]),
        frictionloss=numbers_text(masses.coulomb[arm]),
    )
    _add_point(carriage, masses.carriages[arm])
    size = parts.size
    box = numbers_text(1.2 * size, 1.2 * size, size)
    SubElement(carriage, "geom", type="box", size=box, rgba="0.78 0.47 0.08 1")
    swing, tilt = parts.swing_and_tilt(arm, true, position)
    for rod, place in zip(_rods(arm), parts.rod_places):
        body = SubElement(
            carriage,
            "body",
            name=rod,
            pos=numbers_text(place, 0.0, 0.0),
            quat=numbers_text(
                cos(0.5 * swing) * cos(0.5 * tilt),
                sin(0.5 * swing) * cos(0.5 * tilt),
                cos(0.5 * swing) * sin(0.5 * tilt),
                sin(0.5 * swing) * sin(0.5 * tilt),
            ),
        )
        # The axis across the arm, as it is seen from the rod at the start.
        for joint, axis, value in (
            ("swing", (cos(tilt), 0.0, sin(tilt)), swing),
            ("tilt", (0.0, 1.0, 0.0), tilt),
        ):
            SubElement(
                body,
                "joint",
                name=f"{rod}_{joint}",
                type="hinge",
                axis=numbers_text(*axis),
                ref=numbers_text(value),
            )
        _add_rod(body, masses.arms[arm], parts.arm_lengths[arm], parts.rod_radius)


def _add_rod(body: Element, arm: Arm, length: float, radius: float) -> None:
    """Add mass and shape of one of the two rods of an ``arm``."""
    both = arm.mass * length * length / 12.0 if arm.inertia is None else arm.inertia
    inertia = max(0.5 * both, LEAST_INERTIA)
    SubElement(
        body,
        "inertial",
        pos=numbers_text(0.0, 0.0, -arm.centre * length),
        mass=numbers_text(max(0.5 * arm.mass, LEAST_MASS)),
        diaginertia=numbers_text(inertia, inertia, LEAST_INERTIA),
    )
    SubElement(
        body,
        "geom",
        type="capsule",
        size=numbers_text(radius),
        fromto=numbers_text(0.0, 0.0, 0.0, 0.0, 0.0, -length),
        rgba="0.16 0.18 0.22 1",
    )
    end = f"{body.get('name')}_end"
    SubElement(body, "site", name=end, pos=numbers_text(0.0, 0.0, -length))


def _add_platform(
    world: Element, description: MachineDescription, masses: Masses, position: Vector3
) -> None:
    parts, mass = description.parts, masses.platform + masses.payload
    name = description.platform_frame
    platform = SubElement(world, "body", name=name, pos=numbers_text(*position))
    SubElement(platform, "freejoint", name="platform")
    radius, half = parts.platform_radius, 0.25 * parts.size
    along = 0.5 * mass * radius * radius
    across = 0.5 * along + mass * half * half / 3.0
    SubElement(
        platform,
        "inertial",
        pos="0 0 0",
        mass=numbers_text(mass),
        diaginertia=numbers_text(across, across, along),
    )
    disc = numbers_text(radius, half)
    SubElement(platform, "geom", type="cylinder", size=disc, rgba="0.12 0.47 1 1")
    for arm in range(3):
        (x, y), (ax, ay) = parts.platform_joints[arm], parts.across[arm]
        for rod, along in zip(_rods(arm), parts.rod_places):
            place = numbers_text(x + along * ax, y + along * ay, 0.0)
            SubElement(platform, "site", name=f"{rod}_joint", pos=place)


def _add_counterweight(
    world: Element, equality: Element, description: MachineDescription, masses: Masses, arm: int
) -> None:
    """Add a mass that sinks as its carriage rises."""
    name, mass = f"counterweight_{arm + 1}", masses.counterweights[arm]
    place = numbers_text(*description.parts.column(arm), description.column_ends(arm)[0])
    body = SubElement(world, "body", name=name, pos=place)
    SubElement(body, "joint", name=name, type="slide", axis="0 0 1")
    _add_point(body, mass)
    SubElement(
        equality,
        "joint",
        name=name,
        joint1=name,
        joint2=description.joint_names[arm],
        polycoef="0 -1 0 0 0",
    )


def _add_point(body: Element, mass: float) -> None:
    """Add the mass of a body that never turns, so its inertia has no effect."""
    inertia = numbers_text(*3 * (1e-3 * mass,))
    SubElement(body, "inertial", pos="0 0 0", mass=numbers_text(mass), diaginertia=inertia)


def _add_drive(
    actuator: Element, description: MachineDescription, masses: Masses, arm: int
) -> None:
    """Add a drive that holds its setpoint as a spring and a damper do."""
    moved = masses.carriages[arm] + masses.counterweights[arm] + masses.arms[arm].mass
    moved += masses.platform + masses.payload
    rate = 2.0 * pi * DRIVE_FREQUENCY
    name = description.joint_names[arm]
    SubElement(
        actuator,
        "position",
        name=name,
        joint=name,
        kp=numbers_text(moved * rate * rate),
        kv=numbers_text(2.0 * moved * rate),
        ctrlrange=numbers_text(description.lower_heights[arm], description.upper_heights[arm]),
    )
