"""Forces of the sliders against MuJoCo, with the model that ``describe_machine`` writes.

MuJoCo's own constraints are soft. So only its mass matrix, its bias forces and the Jacobian of the
closed loops are taken, and the equations of motion with the loops closed are solved here.

``python -m benchmarks.mujoco_forces`` tells the largest difference; ``--write`` keeps some motions
and their forces in ``test/dynamics/mujoco_forces.json``, with which a test compares.
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.machine import description
from testing.masses import random_masses
from tri_glide_kinematics.description import RODS, MachineDescription, Parts, mjcf_text
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray

KEPT = Path(__file__).parents[1] / "test" / "dynamics" / "mujoco_forces.json"
KEPT_MOTIONS = 12
GOAL = 1e-6

PLATFORM_RADIUS = 0.05

# The loops of a model are closed at its start within this [m].
CLOSED = 1e-9

JOINTS = ("slider_1", "slider_2", "slider_3")
ROPES = tuple(f"counterweight_{i}" for i in (1, 2, 3))


class MujocoForces:
    """Forces of the sliders without friction, by MuJoCo's equations of motion."""

    def __init__(self, machine: TriGlide, masses: Masses, heights: FloatArray) -> None:
        """Compile the model of a ``machine`` with sliders at ``heights``, shape (3,) [m]."""
        import mujoco

        self._library: Any = mujoco
        parts = Parts.of(machine.geometry, PLATFORM_RADIUS)
        description = MachineDescription(
            machine,
            parts,
            JOINTS,
            "base",
            "platform",
            lower_heights=(-10.0, -10.0, -10.0),
            upper_heights=(10.0, 10.0, 10.0),
            height_offsets=(0.0, 0.0, 0.0),
            velocities=(1.0, 1.0, 1.0),
            forces=(1.0, 1.0, 1.0),
        )
        first, second, third = heights.tolist()
        text = mjcf_text(description, masses, (first, second, third))
        self._model = mujoco.MjModel.from_xml_string(text)
        self._data = mujoco.MjData(self._model)
        hinges = (f"{rod}_{joint}" for rod in RODS for joint in ("swing", "tilt"))
        places = [self._model.joint(name).dofadr[0] for name in (*JOINTS, *hinges, *ROPES)]
        free = self._model.joint("platform").dofadr[0]
        # MuJoCo has the coordinates of each branch one after the other; here the sliders are first.
        self._places = np.array([*places, *range(free, free + 6)])

    def gap(self) -> float:
        """Return how far the end of a rod is from its joint at the platform, at most [m]."""
        self._library.mj_forward(self._model, self._data)
        return max(
            float(np.linalg.norm(self._site(f"{rod}_end") - self._site(f"{rod}_joint")))
            for rod in RODS
        )

    def forces(self, velocities: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Return the forces at the heights of the model. All of shape (3,) [N]."""
        library, model, data = self._library, self._model, self._data
        count = len(self._places)
        data.qvel[:] = 0.0
        library.mj_forward(model, data)
        loops, _ = self._loops()
        rates = _completed(loops, velocities, np.zeros(len(loops)))
        data.qvel[self._places] = rates
        library.mj_forward(model, data)
        loops, turning = self._loops()
        second = _completed(loops, accelerations, -turning @ rates)
        matrix = np.zeros((count, count))
        library.mj_fullM(model, data, matrix)
        matrix = matrix[np.ix_(self._places, self._places)]
        left = matrix @ second + data.qfrc_bias[self._places]
        multipliers = np.linalg.solve(loops[:, 3:].T, left[3:])
        return np.asarray(left[:3] - loops[:, :3].T @ multipliers)

    def _site(self, name: str) -> FloatArray:
        return np.asarray(self._data.site(name).xpos)

    def _loops(self) -> tuple[FloatArray, FloatArray]:
        """Return the Jacobian of the closed loops and its rate. Each of shape (21, 24)."""
        library, model, data = self._library, self._model, self._data
        count = len(self._places)
        rows, turning = np.zeros((count - 3, count)), np.zeros((count - 3, count))
        unused, jacobian, rate = (np.zeros((3, count)) for _ in range(3))
        for i, rod in enumerate(RODS):
            part = slice(3 * i, 3 * i + 3)
            for sign, site, body in ((1.0, f"{rod}_end", rod), (-1.0, f"{rod}_joint", "platform")):
                point, number = self._site(site), model.body(body).id
                library.mj_jac(model, data, jacobian, unused, point, number)
                library.mj_jacDot(model, data, rate, unused, point, number)
                rows[part] += sign * jacobian[:, self._places]
                turning[part] += sign * rate[:, self._places]
        ropes = 3 * len(RODS)
        for i in range(3):
            rows[ropes + i, [i, ropes + i - 3]] = 1.0
        return rows, turning


def _completed(loops: FloatArray, sliders: FloatArray, right: FloatArray) -> FloatArray:
    """Return all coordinates' derivatives for those of the sliders."""
    others = np.linalg.solve(loops[:, 3:], right - loops[:, :3] @ sliders)
    return np.concatenate((sliders, others))


def random_machine(rng: np.random.Generator) -> TriGlide:
    """Return a machine with unequal arms and anchors."""
    angles = np.array((0.0, 2.1, 4.2)) + rng.uniform(-0.4, 0.4, 3)
    anchors = rng.uniform(0.15, 0.3, (3, 1)) * np.column_stack((np.cos(angles), np.sin(angles)))
    return TriGlide(TriGlideGeometry(anchors, rng.uniform(0.4, 0.7, 3)))


def difference(seed: int) -> tuple[float, float, dict[str, Any]]:
    """Return by which part forces differ for a motion at random, the gap, and the motion."""
    rng = np.random.default_rng(seed)
    while True:
        machine = random_machine(rng)
        heights = rng.uniform(0.4, 0.9, 3)
        try:
            if machine.condition_number(machine.forward(heights)) < 15.0:
                break
        except KinematicsError:
            continue
    masses = random_masses(rng, heavy_arms=bool(seed % 2), friction=False)
    motion = (heights, rng.normal(size=3), 20.0 * rng.normal(size=3))
    model = MujocoForces(machine, masses, heights)
    gap = model.gap()
    theirs = model.forces(*motion[1:])
    ours = np.array(SliderForces(machine, masses).forces(*motion))
    kept = {
        "geometry": asdict(machine.geometry),
        "masses": asdict(masses),
        "motion": [each.tolist() for each in motion],
        "forces": theirs.tolist(),
    }
    return float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)), gap, kept


def main() -> int:
    """Compare, and keep some forces if this is asked for."""
    count = 1000, "of machines, one motion each"
    options = numbers(__doc__, count=count, write=(False, f"keep some in {KEPT.name}"))
    print(description(), flush=True)
    found = [difference(seed) for seed in range(options.count)]
    worst, widest = (max(values) for values in list(zip(*found))[:2])
    print(f"largest difference of {options.count}, as a part of the forces: {worst:.2g}")
    print(f"largest gap between a rod and the platform: {widest:.2g} m")
    if options.write:
        kept = [motion for _, _, motion in found[:KEPT_MOTIONS]]
        KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return 0 if worst <= GOAL and widest <= CLOSED else 1


if __name__ == "__main__":
    sys.exit(main())
