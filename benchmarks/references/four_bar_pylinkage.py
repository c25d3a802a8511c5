"""The same four-bar in pylinkage, whose solver is compiled by numba."""

import math
from collections.abc import Callable

from tri_glide_kinematics.vectors import FloatArray


def sweep_of(
    lengths: tuple[float, float, float, float], count: int
) -> tuple[Callable[..., FloatArray], tuple[object, ...]]:
    """Return pylinkage's compiled function and its arguments for one turn in ``count`` steps.

    It returns the joint positions of one branch, of shape (count, 4, 2), after each step; the last
    joint is the rocker pin. This is what its ``Linkage.step_fast`` calls; the bare function is
    faster by the transfer of the state from and to Python objects.

    Args:
        lengths: crank, coupler, rocker, ground [m].
        count: number of crank angles.

    Raises:
        ModuleNotFoundError: if pylinkage or numba is not installed.
    """
    import numba  # noqa: F401  # without it pylinkage works, but is not compiled
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage
    from pylinkage.solver.simulation import simulate

    crank, coupler, rocker, ground = lengths
    crank_pivot = Ground(0.0, 0.0, name="crank pivot")
    rocker_pivot = Ground(ground, 0.0, name="rocker pivot")
    turning = Crank(anchor=crank_pivot, radius=crank, angular_velocity=math.tau / count)
    pin = RRRDyad(turning.output, rocker_pivot, distance1=coupler, distance2=rocker)
    linkage = Linkage([crank_pivot, rocker_pivot, turning, pin])
    linkage.compile()
    linkage.step_fast(count)
    data = linkage._solver_data
    return simulate, (
        *(data.positions, data.constraints, data.joint_types, data.parent_indices),
        *(data.constraint_offsets, data.solve_order, count, 1.0),
    )
