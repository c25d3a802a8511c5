"""The masses of a tri-glide, its friction and its weight."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from tri_glide_kinematics.checks import finite, finite_vector, non_negative, positive
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import vector_text

# Downwards [m/s^2].
STANDARD_GRAVITY = (0.0, 0.0, -9.80665)

# Place of a uniform arm's centre, as a part of its length.
MIDDLE = 0.5


class PayloadOffCentreError(KinematicsError):
    """A payload that is not on the axis of the platform: its weight would turn the platform."""

    def __init__(self, offset: Sequence[float]) -> None:
        """Store the ``offset`` of the payload from the centre of the platform. Shape (3,) [m]."""
        super().__init__(
            f"payload_centre = {vector_text(offset, scale=0.0)} m must be (0, 0) m in x and y: the "
            "platform cannot turn, so the joints of the arms would have to hold the payload's turn"
        )
        self.offset = tuple(offset)


@dataclass(frozen=True)
class Arm:
    """One arm, with all that moves with it; the two rods of a parallelogram count as one arm.

    The platform does not turn, so both rods of a parallelogram always move alike, and no rod
    turns about its own axis. So the masses of both rods are added, and their inertias, each about
    the centre of its own rod.

    Attributes:
        mass: [kg].
        centre: distance of its centre of mass from the end at the carriage, as a part of its
            length, 0 to 1.
        inertia: about an axis across the arm through its centre of mass; None for a uniform arm,
            which has a twelfth of its mass times the square of its length [kg m^2].
    """

    mass: float
    centre: float = MIDDLE
    inertia: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotANumberError: if one of them is no number.
            NotFiniteError: if one of them is NaN or infinite.
            OutOfBoundsError: if one of them is negative, the centre is not on the arm, or is not
                in the middle of an arm without inertia.
        """
        object.__setattr__(self, "mass", non_negative("arm mass", self.mass, "kg"))
        centre = finite("arm centre", self.centre)
        if not 0.0 <= centre <= 1.0:
            raise OutOfBoundsError("arm centre", centre, "from 0 to 1")
        object.__setattr__(self, "centre", centre)
        if self.inertia is not None:
            inertia = non_negative("arm inertia", self.inertia, "kg m^2")
            object.__setattr__(self, "inertia", inertia)
        elif centre != MIDDLE:
            raise OutOfBoundsError(
                "arm centre", centre, f"{MIDDLE} for a uniform arm, which has no inertia given"
            )

    def end_masses(self, length: float) -> Vector3:
        r"""Return the masses that stand for an arm of this ``length`` [m]: a, b and c [kg].

        With $v$ and $w$ the velocities of its ends at the carriage and at the platform, the kinetic
        energy of the arm is $(a v^2 + 2 b\,v \cdot w + c w^2) / 2$ (docs/dynamics.md, section 1).
        """
        if self.inertia is None:
            turning = self.mass / 12.0
        else:
            turning = self.inertia / (length * length)
        near, far = 1.0 - self.centre, self.centre
        return (
            self.mass * near * near + turning,
            self.mass * near * far - turning,
            self.mass * far * far + turning,
        )


@dataclass(frozen=True)
class Masses:
    """What moves, and what acts on it besides the drives.

    Rotating parts of a drive count as mass of its carriage: their inertia divided by the square of
    the way of the carriage for each radian [kg].

    Attributes:
        carriages: Shape (3,) [kg].
        arms: Shape (3,).
        platform: [kg].
        payload: on the platform [kg].
        payload_centre: of the payload, from the centre of the platform; it has to be zero in x and
            y. The height does not change the forces of the sliders. Shape (3,) [m].
        counterweights: each hangs on a rope over a pulley, so it moves down when the carriage moves
            up: it adds its inertia and takes off its weight. Shape (3,) [kg].
        coulomb: dry friction of each slider, without regard to its speed. Shape (3,) [N].
        viscous: friction of each slider for its speed. Shape (3,) [N s/m].
        gravity: in any direction. Shape (3,) [m/s^2].
    """

    carriages: Vector3
    arms: tuple[Arm, Arm, Arm]
    platform: float
    payload: float = 0.0
    payload_centre: Vector3 = (0.0, 0.0, 0.0)
    counterweights: Vector3 = (0.0, 0.0, 0.0)
    coulomb: Vector3 = (0.0, 0.0, 0.0)
    viscous: Vector3 = (0.0, 0.0, 0.0)
    gravity: Vector3 = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        """Check the numbers and store them as plain floats.

        Raises:
            WrongShapeError: if a vector has not three numbers, or there are not three arms.
            KinematicsError: if one of the arms is none.
            NotANumberError: if something is no number.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a mass or a friction is negative, or the mass of the platform or
                of a carriage is not greater than zero.
            PayloadOffCentreError: if the payload is not on the axis of the platform.
        """
        for name, unit in (
            ("carriages", "kg"),
            ("counterweights", "kg"),
            ("coulomb", "N"),
            ("viscous", "N s/m"),
        ):
            check = positive if name == "carriages" else non_negative
            values = finite_vector(name, getattr(self, name), 3)
            checked = tuple(check(f"{name}[{i}]", value, unit) for i, value in enumerate(values))
            object.__setattr__(self, name, checked)
        arms = tuple(self.arms) if isinstance(self.arms, Iterable) else ()
        if len(arms) != 3:
            raise WrongShapeError("arms", (len(arms),), "(3,)")
        for i, arm in enumerate(arms):
            if not isinstance(arm, Arm):
                raise KinematicsError(
                    f"arms[{i}] = {arm!r} must be an Arm, which has more than a mass"
                )
        object.__setattr__(self, "arms", arms)
        object.__setattr__(self, "platform", positive("platform", self.platform, "kg"))
        object.__setattr__(self, "payload", non_negative("payload", self.payload, "kg"))
        object.__setattr__(self, "gravity", finite_vector("gravity", self.gravity, 3))
        offset = finite_vector("payload_centre", self.payload_centre, 3)
        object.__setattr__(self, "payload_centre", offset)
        if offset[0] != 0.0 or offset[1] != 0.0:
            raise PayloadOffCentreError(offset)

    @classmethod
    def uniform(
        cls,
        carriage: float,
        arm: float,
        platform: float,
        *,
        payload: float = 0.0,
        counterweight: float = 0.0,
        coulomb: float = 0.0,
        viscous: float = 0.0,
        gravity: Vector3 = STANDARD_GRAVITY,
    ) -> Masses:
        """Return the masses of a machine with three equal carriages and three equal, uniform arms.

        Args:
            carriage: mass of each carriage [kg].
            arm: mass of each arm, both rods of it [kg].
            platform: its mass [kg].
            payload: on the platform [kg].
            counterweight: of each slider [kg].
            coulomb: dry friction of each slider [N].
            viscous: friction of each slider for its speed [N s/m].
            gravity: Shape (3,) [m/s^2].

        Raises:
            KinematicsError: as for ``Masses``.
        """
        one_arm = Arm(arm)
        return cls(
            (carriage,) * 3,
            (one_arm, one_arm, one_arm),
            platform,
            payload,
            counterweights=(counterweight,) * 3,
            coulomb=(coulomb,) * 3,
            viscous=(viscous,) * 3,
            gravity=gravity,
        )

    def with_payload(self, payload: float) -> Masses:
        """Return the same masses with another ``payload`` [kg].

        Raises:
            KinematicsError: as for ``Masses``.
        """
        return replace(self, payload=payload)


class Constants(NamedTuple):
    r"""The masses of a machine in the velocities of its sliders and of its platform.

    Attributes:
        sliders: mass that moves with each slider. Shape (3,) [kg].
        couplings: mass of each arm between slider and platform. Shape (3,) [kg].
        platform: mass that moves with the platform [kg].
        weights: forces of gravity on the sliders, upwards. Shape (3,) [N].
        weight: force of gravity on the platform. Shape (3,) [N].
    """

    sliders: Vector3
    couplings: Vector3
    platform: float
    weights: Vector3
    weight: Vector3

    @classmethod
    def of(cls, lengths: Sequence[float], masses: Masses) -> Constants:
        """Return those of a machine with arms of these ``lengths``. Shape (3,) [m]."""
        sliders, couplings, weights = [], [], []
        platform = hung = masses.platform + masses.payload
        gravity = masses.gravity
        for length, arm, carriage, counterweight in zip(
            lengths, masses.arms, masses.carriages, masses.counterweights
        ):
            near, coupling, far = arm.end_masses(length)
            sliders.append(carriage + counterweight + near)
            couplings.append(coupling)
            platform += far
            # The weight of an arm is shared out to its ends as by a lever.
            hung += arm.mass * arm.centre
            weights.append(gravity[2] * (carriage - counterweight + arm.mass * (1.0 - arm.centre)))
        return cls(
            (sliders[0], sliders[1], sliders[2]),
            (couplings[0], couplings[1], couplings[2]),
            platform,
            (weights[0], weights[1], weights[2]),
            (gravity[0] * hung, gravity[1] * hung, gravity[2] * hung),
        )
