"""Rods of URDF and MJCF meet the platform; the files are evaluated as other programs do it."""

from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from testing.masses import random_masses
from tri_glide_kinematics.description import (
    PASSIVE_JOINTS,
    RODS,
    MachineDescription,
    Parts,
    mjcf_text,
    urdf_text,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3

CLOSED = 1e-9
NAMES = ("left & first", "slider_2", "z3")
IDENTITY = np.eye(4)


def described(geometry: TriGlideGeometry, offsets: Vector3 = (0.0, 0.0, 0.0), **drawn: float):
    return MachineDescription(
        TriGlide(geometry),
        Parts.of(geometry, drawn.get("platform_radius", 0.05), drawn.get("rod_distance")),
        NAMES,
        "tri_glide_base",
        "tri_glide_platform",
        (0.3, 0.31, 0.29),
        (0.9, 0.92, 0.91),
        offsets,
        (1.0, 1.1, 1.2),
        (100.0, 110.0, 120.0),
    )


def machines() -> list[MachineDescription]:
    """The default machine, one with an anchor on the axis, and calibrated ones."""
    found = [
        described(DEFAULT_GEOMETRY),
        described(TriGlideGeometry([[0.0, 0.0], [0.25, 0.0], [0.0, 0.25]], [0.4, 0.5, 0.45])),
    ]
    source = np.random.default_rng(28)
    for _ in range(6):
        turns = np.array((0.0, 2.1, 4.2)) + source.uniform(-0.4, 0.4, 3)
        anchors = source.uniform(0.15, 0.3, (3, 1)) * np.column_stack(
            (np.cos(turns), np.sin(turns))
        )
        first, second, third = source.uniform(-0.02, 0.02, 3).tolist()
        found.append(
            described(
                TriGlideGeometry(anchors, source.uniform(0.4, 0.7, 3)),
                (first, second, third),
                platform_radius=source.uniform(0.0, 0.1),
                rod_distance=source.uniform(0.01, 0.1),
            )
        )
    return found


MACHINES = machines()


def poses(machine: MachineDescription, count: int) -> list[tuple[Vector3, Vector3]]:
    """Heights as they are reported, and the position of the platform that belongs to them."""
    source = np.random.default_rng(7)
    found: list[tuple[Vector3, Vector3]] = []
    while len(found) < count:
        first, second, third = source.uniform(machine.lower_heights, machine.upper_heights).tolist()
        heights = first, second, third
        try:
            found.append((heights, machine.machine.forward(machine.true_heights(heights))))
        except KinematicsError:
            continue
    return found


def turned(rotation: Rotation) -> FloatArray:
    result = IDENTITY.copy()
    result[:3, :3] = rotation.as_matrix()
    return result


def turn(axis: FloatArray, angle: float) -> FloatArray:
    return turned(Rotation.from_rotvec(angle * axis))


def moved(place: FloatArray) -> FloatArray:
    result = IDENTITY.copy()
    result[:3, 3] = place
    return result


def numbers(element: ElementTree.Element, name: str) -> FloatArray:
    return np.array(element.attrib[name].split(), dtype=float)


class Tree:
    """A URDF, and where its links are for values of its joints."""

    def __init__(self, text: str) -> None:
        self.robot = ElementTree.fromstring(text)
        self.joints = {
            joint.find("child").attrib["link"]: joint for joint in self.robot.findall("joint")
        }
        self.links = {link.attrib["name"] for link in self.robot.findall("link")}

    def place_of(self, link: str, values: dict[str, float]) -> FloatArray:
        """Homogeneous matrix of a link. Shape (4, 4)."""
        joint = self.joints.get(link)
        if joint is None:
            return IDENTITY
        before = self.place_of(joint.find("parent").attrib["link"], values)
        origin, axis = joint.find("origin"), numbers(joint.find("axis"), "xyz")
        result = before @ moved(numbers(origin, "xyz"))
        result = result @ turned(Rotation.from_euler("xyz", numbers(origin, "rpy")))
        value = values[joint.attrib["name"]]
        if joint.attrib["type"] == "prismatic":
            return result @ moved(value * axis)
        assert joint.attrib["type"] == "continuous"
        return result @ turn(axis, value)

    def length_of(self, rod: str) -> float:
        link = next(each for each in self.robot.findall("link") if each.attrib["name"] == rod)
        return float(link.find("visual/geometry/cylinder").attrib["length"])


def platform_joint(machine: MachineDescription, rod: int) -> FloatArray:
    """Where the lower end of a rod is held, from the centre of the platform. Shape (3,)."""
    arm, side = divmod(rod, 2)
    middle, across = (
        np.array((*each[arm], 0.0))
        for each in (machine.parts.platform_joints, machine.parts.across)
    )
    return middle + (side - 0.5) * machine.parts.rod_distance * across


@pytest.mark.parametrize("machine", MACHINES)
def test_rods_of_the_urdf_meet_the_platform(machine: MachineDescription):
    tree = Tree(urdf_text(machine))
    for heights, position in poses(machine, 20):
        passive = machine.parts.passive_values(machine.true_heights(heights), position)
        values = dict(zip((*NAMES, *PASSIVE_JOINTS), (*heights, *passive)))
        platform = tree.place_of("tri_glide_platform", values)
        assert platform == pytest.approx(moved(np.array(position)), abs=CLOSED)
        for index, rod in enumerate(RODS):
            hangs = tree.place_of(rod, values)
            end = hangs @ (0.0, 0.0, -tree.length_of(rod), 1.0)
            meets = platform @ (*platform_joint(machine, index), 1.0)
            assert np.linalg.norm(end - meets) < CLOSED
            carriage = tree.place_of(f"carriage_{index // 2 + 1}", values)
            expected = machine.true_heights(heights)[index // 2]
            assert carriage[2, 3] == pytest.approx(expected, abs=CLOSED)
            tower = np.array(machine.parts.towers[index // 2])
            assert np.linalg.norm(hangs[:2, 3] - tower) == pytest.approx(
                0.5 * machine.parts.rod_distance, abs=CLOSED
            )


def test_the_urdf_is_one_tree_of_the_joints_that_are_published():
    machine = MACHINES[-1]
    tree = Tree(urdf_text(machine))
    assert len(tree.joints) == len(tree.robot.findall("joint"))
    assert tree.links - set(tree.joints) == {"tri_glide_base"}
    assert {joint.attrib["name"] for joint in tree.joints.values()} == {*NAMES, *PASSIVE_JOINTS}
    slider = tree.joints["carriage_2"]
    limit = {name: float(text) for name, text in slider.find("limit").attrib.items()}
    assert limit == {"lower": 0.31, "upper": 0.92, "velocity": 1.1, "effort": 110.0}


def test_limits_of_the_platform_hold_everywhere():
    for machine in MACHINES:
        tree = Tree(urdf_text(machine))
        links = ("platform_x_slide", "platform_y_slide", "tri_glide_platform")
        limits = [tree.joints[link].find("limit") for link in links]
        lower, upper = (
            [float(limit.attrib[name]) for limit in limits] for name in ("lower", "upper")
        )
        for _, position in poses(machine, 50):
            assert np.all(lower < np.array(position))
            assert np.all(np.array(position) < upper)


@pytest.mark.parametrize("machine", MACHINES)
def test_the_loops_of_the_mjcf_are_closed_at_the_start(machine: MachineDescription):
    masses = random_masses(np.random.default_rng(3))
    for heights, position in poses(machine, 5):
        root = ElementTree.fromstring(mjcf_text(machine, masses, heights))
        bodies = {body.attrib["name"]: body for body in root.iter("body")}
        platform = bodies["tri_glide_platform"]
        assert numbers(platform, "pos") == pytest.approx(position, abs=CLOSED)
        assert platform.find("freejoint") is not None, "it would be fixed to the world"
        sites = {site.attrib["name"]: numbers(site, "pos") for site in root.iter("site")}
        references = {
            joint.attrib["name"]: float(joint.attrib["ref"])
            for joint in root.iter("joint")
            if "ref" in joint.attrib
        }
        passive = machine.parts.passive_values(machine.true_heights(heights), position)
        named = dict(zip((*NAMES, *PASSIVE_JOINTS), (*heights, *passive)))
        assert references == pytest.approx({name: named[name] for name in references}, abs=1e-12)
        connected = {each.attrib["name"]: each for each in root.iter("connect")}
        assert tuple(connected) == RODS
        for index, rod in enumerate(RODS):
            carriage, body = bodies[f"carriage_{index // 2 + 1}"], bodies[rod]
            hangs = moved(numbers(carriage, "pos")) @ turn(
                np.array((0.0, 0.0, 1.0)), numbers(carriage, "euler")[2]
            )
            # Turned back by all references, the rod hangs straight down.
            straight = hangs @ moved(numbers(body, "pos"))
            w, *xyz = numbers(body, "quat")
            hangs = straight @ turned(Rotation.from_quat((*xyz, w)))
            swing, tilt = (references[f"{rod}_{joint}"] for joint in ("swing", "tilt"))
            both = turn(np.array((1.0, 0.0, 0.0)), swing) @ turn(np.array((0.0, 1.0, 0.0)), tilt)
            assert straight @ both == pytest.approx(hangs, abs=1e-12)
            axis = numbers(body.find("joint"), "axis")
            assert (both[:3, :3] @ axis) == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)
            end = hangs @ (*numbers(connected[rod], "anchor"), 1.0)
            meets = position + sites[f"{rod}_joint"]
            assert np.linalg.norm(end[:3] - meets) < CLOSED
            assert sites[f"{rod}_joint"] == pytest.approx(platform_joint(machine, index), abs=1e-12)


def test_the_mjcf_has_all_masses():
    masses = random_masses(np.random.default_rng(3))
    root = ElementTree.fromstring(mjcf_text(MACHINES[0], masses))
    total = sum(float(each.attrib["mass"]) for each in root.iter("inertial"))
    expected = sum((*masses.carriages, *masses.counterweights, masses.platform, masses.payload))
    expected += sum(arm.mass for arm in masses.arms)
    assert total == pytest.approx(expected)
    # Without any, what is assumed is enough for MuJoCo.
    root = ElementTree.fromstring(mjcf_text(MACHINES[0]))
    assert all(float(each.attrib["mass"]) > 0.0 for each in root.iter("inertial"))
    assert not [each for each in root.iter("body") if "counterweight" in each.attrib["name"]]
