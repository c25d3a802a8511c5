"""Forces of the sliders against MuJoCo: the same machine as bodies with joints.

MuJoCo's own constraints are soft. So only its mass matrix, its bias forces and the Jacobian of the
closed loops are taken, and the equations of motion with the loops closed are solved here.

``python -m benchmarks.mujoco_forces`` tells the largest difference; ``--write`` keeps some motions
and their forces in ``test/dynamics/mujoco_forces.json``, with which a test compares.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import description
from testing.masses import random_masses
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray

KEPT = Path(__file__).parents[1] / "test" / "dynamics" / "mujoco_forces.json"
KEPT_MOTIONS = 12
GOAL = 1e-6

# About its own axis: an arm does not turn, but a body needs an inertia in each direction [kg m^2].
NO_INERTIA = 1e-13
# Three sliders, two angles of each arm, the platform, three counterweights.
SLIDERS, ANGLES, PLATFORM, ROPES = slice(0, 3), slice(3, 9), slice(9, 12), slice(12, 15)


def model_text(geometry: TriGlideGeometry, masses: Masses) -> str:
    """Return the machine in MuJoCo's language, with its loops open at the platform."""
    sliders, ropes = "", ""
    for i, ((x, y), length, arm) in enumerate(
        zip(geometry.anchors, geometry.arm_lengths, masses.arms)
    ):
        inertia = arm.mass * length**2 / 12.0 if arm.inertia is None else arm.inertia
        sliders += f"""
      <body name="carriage_{i}" pos="{x!r} {y!r} 0">
        <joint name="slider_{i}" type="slide" axis="0 0 1"/>
        {_point(masses.carriages[i])}
        <body name="arm_{i}">
          <joint name="roll_{i}" type="hinge" axis="1 0 0"/>
          <joint name="pitch_{i}" type="hinge" axis="0 1 0"/>
          <inertial pos="0 0 {-arm.centre * length!r}" mass="{arm.mass!r}"
            diaginertia="{inertia!r} {inertia!r} {NO_INERTIA!r}"/>
          <site name="end_{i}" pos="0 0 {-length!r}"/>
        </body>
      </body>"""
        ropes += f"""
      <body name="counterweight_{i}">
        <joint name="rope_{i}" type="slide" axis="0 0 1"/>{_point(masses.counterweights[i])}
      </body>"""
    slides = "".join(
        f'<joint name="{name}" type="slide" axis="{axis}"/>'
        for name, axis in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1"))
    )
    gravity = " ".join(map(repr, masses.gravity))
    return f"""<mujoco>
    <compiler angle="radian" balanceinertia="false" boundmass="0" boundinertia="0"/>
    <option gravity="{gravity}"/>
    <worldbody>{sliders}
      <body name="platform">{slides}{_point(masses.platform + masses.payload)}
        <site name="centre"/>
      </body>{ropes}
    </worldbody></mujoco>"""


def _point(mass: float) -> str:
    """Return a body that never turns, so its inertia has no effect."""
    return f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="0.001 0.001 0.001"/>'


class MujocoForces:
    """Forces of the sliders without friction, by MuJoCo's equations of motion."""

    def __init__(self, machine: TriGlide, masses: Masses) -> None:
        """Compile the model."""
        import mujoco

        self._library: Any = mujoco
        self._machine = machine
        self._model = mujoco.MjModel.from_xml_string(model_text(machine.geometry, masses))
        self._data = mujoco.MjData(self._model)
        names = [f"slider_{i}" for i in range(3)]
        names += [f"{kind}_{i}" for i in range(3) for kind in ("roll", "pitch")]
        names += ["x", "y", "z", *(f"rope_{i}" for i in range(3))]
        places = [self._model.joint(name).dofadr[0] for name in names]
        # MuJoCo has the coordinates of each branch one after the other.
        self._places = np.array(places)

    def forces(
        self, heights: FloatArray, velocities: FloatArray, accelerations: FloatArray
    ) -> FloatArray:
        """Return the forces. All of shape (3,) [N]."""
        library, model, data = self._library, self._model, self._data
        position = np.array(self._machine.forward(heights))
        coordinates = np.zeros(15)
        coordinates[SLIDERS] = heights
        coordinates[ROPES] = -heights
        coordinates[PLATFORM] = position
        geometry = self._machine.geometry
        angles = []
        for anchor, height, length in zip(geometry.anchors, heights, geometry.arm_lengths):
            x, y, z = (position - (*anchor, height)) / length
            angles += [np.arctan2(y, -z), -np.arcsin(x)]
        coordinates[ANGLES] = angles
        data.qpos[self._places] = coordinates
        data.qvel[:] = 0.0
        library.mj_forward(model, data)
        loops, _ = self._loops()
        rates = _completed(loops, velocities, np.zeros(len(loops)))
        data.qvel[self._places] = rates
        library.mj_forward(model, data)
        loops, turning = self._loops()
        second = _completed(loops, accelerations, -turning @ rates)
        matrix = np.zeros((15, 15))
        library.mj_fullM(model, data, matrix)
        matrix = matrix[np.ix_(self._places, self._places)]
        left = matrix @ second + data.qfrc_bias[self._places]
        multipliers = np.linalg.solve(loops[:, 3:].T, left[3:])
        return np.asarray(left[:3] - loops[:, :3].T @ multipliers)

    def _loops(self) -> tuple[FloatArray, FloatArray]:
        """Return the Jacobian of the closed loops and its rate. Each of shape (12, 15)."""
        library, model, data = self._library, self._model, self._data
        rows, turning = np.zeros((12, 15)), np.zeros((12, 15))
        unused, jacobian, rate = (np.zeros((3, 15)) for _ in range(3))
        for i in range(3):
            part = slice(3 * i, 3 * i + 3)
            for sign, site, body in ((1.0, f"end_{i}", f"arm_{i}"), (-1.0, "centre", "platform")):
                point = data.site(site).xpos
                number = model.body(body).id
                library.mj_jac(model, data, jacobian, unused, point, number)
                library.mj_jacDot(model, data, rate, unused, point, number)
                rows[part] += sign * jacobian[:, self._places]
                turning[part] += sign * rate[:, self._places]
            rows[9 + i, [i, 12 + i]] = 1.0
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


def difference(seed: int) -> tuple[float, dict[str, Any]]:
    """Return the largest part by which forces differ for a motion at random, and the motion."""
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
    theirs = MujocoForces(machine, masses).forces(*motion)
    ours = np.array(SliderForces(machine, masses).forces(*motion))
    kept = {
        "geometry": asdict(machine.geometry),
        "masses": asdict(masses),
        "motion": [each.tolist() for each in motion],
        "forces": theirs.tolist(),
    }
    return float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)), kept


def main() -> int:
    """Compare, and keep some forces if this is asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mujoco_forces", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="of machines, one motion each")
    parser.add_argument("--write", action="store_true", help=f"keep some in {KEPT.name}")
    options = parser.parse_args()
    print(description(), flush=True)
    found = [difference(seed) for seed in range(options.count)]
    worst = max(part for part, _ in found)
    print(f"largest difference of {options.count}, as a part of the forces: {worst:.2g}")
    if options.write:
        kept = [motion for _, motion in found[:KEPT_MOTIONS]]
        KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return 0 if worst <= GOAL else 1


if __name__ == "__main__":
    sys.exit(main())
