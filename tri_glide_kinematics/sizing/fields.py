r"""Quantities of a machine at places, each with a bound for all places around.

All of them follow from the Jacobian J of the heights, which does not depend on the height of the
platform. A *cell* is a place and a radius d. Row j of J is the gradient of the rise $s_j$, so its
derivatives are known: none of the first is larger than $K_j = L_j^2/s_j^3$, none of the second than
$T_j = 3 L_j^2 r_j/s_j^5$, with the distance $r_j$ and the rise at the farthest place of the cell.
With $\sigma$ the least singular value in the cell, and K and T the roots of the sums of squares, a
column n of the inverse has first derivatives of at most $|n| K/\sigma$, and second ones of at most
$|n| (2 K^2/\sigma^2 + T/\sigma)$. So errors and forces have a bound that is the value at the place,
d times the exact gradient there, and $d^2/2$ times what bounds the second derivatives. The bound of
the condition number needs K only. With the radius 0 the bound is the value itself.

The length of a vector v may have larger second derivatives than $S + |G|^2/|v|$, with its first
derivatives G at the place and S, which bounds its second ones. Used in their place it gives a bound
all the same: at a displacement u, $|v + G u| \le |v| + v \cdot G u/|v| + |G u|^2/(2 |v|)$, and all
else of v is at most $S d^2/2$.

The largest value over a whole volume is proved by halving cells: one whose bound is no more than a
little above the largest value that is known is done; all others are cut into four.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.dynamics import Constants, Masses
from tri_glide_kinematics.sizing.wish import Volume, level_box, nearest_inside
from tri_glide_kinematics.tri_glide import (
    TriGlideGeometry,
    extreme_singular_values_batch,
    jacobian_rows,
    least_rises,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Errors of the three sliders with the same size and any signs; the opposite signs give the same.
SIGNS = np.array([(1.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0)])


class Loads(NamedTuple):
    """Constant masses and weights of machines, as ``SliderForces`` uses them.

    Each has one column for all places, or one for each.

    Attributes:
        sliders: what each slider moves by itself. Shape (3, n) [kg].
        couplings: by which slider and platform accelerate each other. Shape (3, n) [kg].
        platform: what the platform moves. Shape (1, n) [kg].
        weights: that pull each slider upwards. Shape (3, n) [N].
        weight: that pulls the platform. Shape (3, n) [N].
        coulomb: dry friction of each slider. Shape (3, n) [N].
        viscous: friction of each slider for its speed. Shape (3, n) [N s/m].
    """

    sliders: FloatArray
    couplings: FloatArray
    platform: FloatArray
    weights: FloatArray
    weight: FloatArray
    coulomb: FloatArray
    viscous: FloatArray

    @classmethod
    def of(cls, masses: Masses, arm_lengths: Vector3) -> Loads:
        """Return those of a machine with these ``arm_lengths`` [m]."""
        numbers = (*Constants.of(arm_lengths, masses), masses.coulomb, masses.viscous)
        return cls(*(np.array(number).reshape(-1, 1) for number in numbers))


@dataclass(frozen=True, eq=False)
class Cells:
    """Places of the platform in a level, with all that bounds need.

    Attributes:
        rows: the Jacobian: row, column, number of the place. Shape (3, 3, n).
        inverse: its inverse. Shape (3, 3, n).
        largest: singular value. Shape (n,).
        smallest: singular value; not positive in the other assembly mode. Shape (n,).
        bends: largest change of each row per metre in the cell. Shape (3, n) [1/m].
        change: largest change of the Jacobian in the cell. Shape (n,).
        rises: least one of each arm in the cell. Shape (3, n) [m].
        slopes: how the Jacobian changes along x and y at the place: row, column (the third one
            never changes), x or y, number. Shape (3, 2, 2, n) [1/m].
        across: from the place to each anchor. Shape (3, 2, n) [m].
        lengths: of the arms, one column for all places or one for each. Shape (3, 1) or (3, n) [m].
        radius: of all cells [m].
    """

    rows: FloatArray
    inverse: FloatArray
    largest: FloatArray
    smallest: FloatArray
    bends: FloatArray
    change: FloatArray
    rises: FloatArray
    slopes: FloatArray
    across: FloatArray
    lengths: FloatArray
    radius: float

    @classmethod
    def around(cls, across: FloatArray, lengths: FloatArray, radius: float = 0.0) -> Cells:
        """Return the cells of a ``radius`` [m].

        What is out of reach has NaN or infinity, and no warning.

        Args:
            across: from the platform to each anchor. Shape (3, 2, n) [m].
            lengths: of the arms. Shape (3, 1) or (3, n) [m].
            radius: of all cells [m].
        """
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            distances, rise, rows = jacobian_rows(across, lengths)
            least = least_rises(lengths, distances, radius)
            bends = lengths**2 / least**3
            largest, smallest = extreme_singular_values_batch(rows)
            following, preceding = rows[[1, 2, 0]], rows[[2, 0, 1]]
            columns = following[:, [1, 2, 0]] * preceding[:, [2, 0, 1]]
            columns -= following[:, [2, 0, 1]] * preceding[:, [1, 2, 0]]
            determinant = (rows[0] * columns[0]).sum(axis=0)
            inverse = (columns / determinant).transpose(1, 0, 2)
            change = radius * np.sqrt(np.square(bends).sum(axis=0))
            slopes = -rows[:, :2, np.newaxis] * rows[:, np.newaxis, :2]
            slopes[:, 0, 0] -= 1.0
            slopes[:, 1, 1] -= 1.0
            slopes /= rise[:, np.newaxis, np.newaxis]
        return cls(
            rows, inverse, largest, smallest, bends, change, least, slopes, across, lengths, radius
        )

    @classmethod
    def of(cls, geometry: TriGlideGeometry, places: ArrayLike, radius: float = 0.0) -> Cells:
        """Return the cells about ``places`` of a machine.

        The smallest singular value has the sign of the determinant as if the anchors stood
        counter-clockwise, so it is positive in all poses of the machine.

        Args:
            geometry: of the machine.
            places: x and y of the platform; more columns do not matter. Shape (n, 2 or more) [m].
            radius: of all cells [m].
        """
        level = np.asarray(places, dtype=np.float64)[:, :2]
        across = np.asarray(geometry.anchors)[:, :, np.newaxis] - level.T
        cells = cls.around(across, np.array(geometry.arm_lengths)[:, np.newaxis], radius)
        np.multiply(cells.smallest, geometry.handedness, out=cells.smallest)
        return cells

    @property
    def _part(self) -> FloatArray:
        """By which part of its length a column of the inverse changes at most. Shape (n,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return _or_infinite(self.change / self._least)

    def conditions(self) -> FloatArray:
        """Return the largest condition number in each cell. Shape (n,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return _or_infinite((self.largest + self.change) / self._least)

    def speed_ratios(self) -> FloatArray:
        """Return the largest speed of each slider for a platform speed of 1 in any direction.

        Returns:
            Shape (3, n).
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            return _or_infinite(self.lengths / self.rises)

    def position_errors(self) -> FloatArray:
        """Return the largest position error for errors of at most 1 of each slider. Shape (n,)."""
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            errors = np.einsum("ijn,kj->kin", self.inverse, SIGNS)
            sizes = np.sqrt(np.square(errors).sum(axis=1))
            if self.radius:
                slopes = self._inverse_slopes(errors)
                gradients = (slopes * errors[:, :, np.newaxis]).sum(axis=1) / sizes[:, np.newaxis]
                sizes = sizes + self._beyond(gradients, self._curved(sizes, slopes))
            return _or_infinite(sizes.max(axis=0))

    def _inverse_slopes(self, columns: FloatArray) -> FloatArray:
        """Return how the inverse times fixed vectors changes along x and y at the place.

        Args:
            columns: the inverse times these vectors. Shape (k, 3, n).

        Returns:
            Shape (k, 3, 2, n).
        """
        turned = np.einsum("jcdn,kcn->kjdn", self.slopes, columns[:, :2])
        return -np.einsum("ijn,kjdn->kidn", self.inverse, turned)

    def _second(self, sizes: FloatArray) -> FloatArray:
        """Return what bounds the second derivatives of columns of these ``sizes``. (k, n)."""
        first = np.sqrt(np.square(self.bends).sum(axis=0)) / self._least
        second = np.sqrt(np.square(self._thirds).sum(axis=0)) / self._least
        return np.asarray(sizes * (1.0 + self._part) * (2.0 * first * first + second))

    def _curved(self, sizes: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return what takes the place of a bound of second derivatives for lengths of columns.

        Elsewhere in the cell the second derivatives may be larger. But the length itself grows by
        no more than ``_beyond`` makes of this: see the top of this module.

        Returns:
            Shape (k, n).
        """
        return self._second(sizes) + np.square(slopes).sum(axis=(1, 2)) / sizes

    def _beyond(self, gradients: FloatArray, second: FloatArray) -> FloatArray:
        """Return by how much a quantity grows at most in the cell. (k, 2, n) and (k, n)."""
        size = np.sqrt(np.square(gradients).sum(axis=1))
        return np.asarray(self.radius * (size + 0.5 * self.radius * second))

    @property
    def _least(self) -> FloatArray:
        """What the least singular value in the cell surely is. Shape (n,)."""
        return np.where(self.smallest > self.change, self.smallest - self.change, 0.0)

    @property
    def _distances(self) -> FloatArray:
        """Largest horizontal length of each arm in the cell. Shape (3, n) [m]."""
        return np.asarray(np.sqrt((self.lengths - self.rises) * (self.lengths + self.rises)))

    @property
    def _thirds(self) -> FloatArray:
        """What bounds the second derivatives of each row in the cell. Shape (3, n) [1/m^2]."""
        return np.asarray(3.0 * self.lengths**2 * self._distances / self.rises**5)

    def softnesses(self) -> FloatArray:
        """Return the largest displacement for a force of 1 on the platform and stiffness 1.

        Each slider yields by its force divided by the stiffness of its drive; its inverse is the
        least stiffness of the platform, as a part of that of one drive. Shape (n,).
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            return _or_infinite(1.0 / np.square(self._least))

    def forces(self, loads: Loads, speed: float, acceleration: float) -> FloatArray:
        """Return the largest force of each slider, upwards or downwards.

        The platform has a velocity of at most ``speed`` [m/s] and an acceleration of at most
        ``acceleration`` [m/s^2], both in any direction. The part of gravity and acceleration is
        exact; that of the velocity is a bound, as it adds what the arms need as if all of them
        pointed along the velocity.

        Returns:
            Shape (3, n) [N].
        """
        sliders, couplings = loads.sliders, loads.couplings
        columns = self.inverse.transpose(1, 0, 2)  # row i: what slider i alone does
        upwards = columns[:, 2]
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            coupled = (couplings[:, np.newaxis] * self.rows).sum(axis=0)
            held = -loads.weights - (columns * loads.weight).sum(axis=1)
            linear = sliders[:, np.newaxis] * self.rows + loads.platform * columns
            linear += upwards[:, np.newaxis] * coupled
            linear[:, 2] += couplings
            sizes = np.sqrt(np.square(linear).sum(axis=1))
            column_sizes = np.sqrt(np.square(columns).sum(axis=1))
            grown = column_sizes * self._part if self.radius else 0.0 * upwards
            bends = (np.abs(couplings) * self.bends).sum(axis=0)
            rise = self.lengths / np.sqrt(np.square(self.rows).sum(axis=1))
            bend = self.lengths**2 / rise**3
            squared = speed * speed
            up = held + squared * np.maximum(grown - upwards, 0.0) * bends
            down = squared * (sliders * bend + np.maximum(grown + upwards, 0.0) * bends) - held
            if self.radius:
                more = self._more_force(loads, columns, column_sizes, linear, sizes, coupled)
                held_slopes, needed_slopes, second = more
                bend_slopes = -3.0 * (bend / rise**2)[:, np.newaxis] * self.across
                distances = self._distances
                bent = 3.0 * self.lengths**2 * (self.rises**2 + 5.0 * distances**2)
                bent /= self.rises**7
                needed_slopes = acceleration * needed_slopes
                weight = np.sqrt(np.square(loads.weight).sum(axis=0))
                curved = acceleration * second + weight * self._second(column_sizes)
                up += self._beyond(needed_slopes + held_slopes, curved)
                turning = squared * sliders
                down += self._beyond(
                    needed_slopes - held_slopes + turning[:, np.newaxis] * bend_slopes,
                    curved + turning * bent,
                )
            friction = loads.coulomb + loads.viscous * speed * self.speed_ratios()
            return _or_infinite(acceleration * sizes + np.maximum(up, down) + friction)

    def _more_force(
        self,
        loads: Loads,
        columns: FloatArray,
        column_sizes: FloatArray,
        linear: FloatArray,
        sizes: FloatArray,
        coupled: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return derivatives of the forces that hold, and that accelerate by 1.

        Returns:
            The gradients of both, each of shape (3, 2, n), and what takes the place of a bound of
            the second derivatives of that which accelerates, as ``_curved``, of shape (3, n).
        """
        sliders, couplings = loads.sliders, loads.couplings
        upwards = columns[:, 2]
        slopes = self._inverse_slopes(columns)
        held_slopes = -(slopes * loads.weight[:, np.newaxis]).sum(axis=1)
        row_slopes = np.concatenate((self.slopes, np.zeros_like(self.slopes[:, :1])), axis=1)
        coupled_slopes = (couplings[:, np.newaxis, np.newaxis] * row_slopes).sum(axis=0)
        changes = sliders[:, np.newaxis, np.newaxis] * row_slopes
        changes += loads.platform * slopes
        changes += slopes[:, 2:] * coupled[:, np.newaxis]
        changes += upwards[:, np.newaxis, np.newaxis] * coupled_slopes
        needed_slopes = (changes * linear[:, :, np.newaxis]).sum(axis=1) / sizes[:, np.newaxis]
        most = column_sizes * (1.0 + self._part)
        first = most * np.sqrt(np.square(self.bends).sum(axis=0)) / self._least
        second = self._second(column_sizes)
        bends = (np.abs(couplings) * self.bends).sum(axis=0)
        moved = loads.platform + np.sqrt(np.square(coupled).sum(axis=0)) + self.radius * bends
        curved = (
            sliders * self._thirds
            + second * moved
            + 2.0 * first * bends
            + most * (np.abs(couplings) * self._thirds).sum(axis=0)
            + np.square(changes).sum(axis=(1, 2)) / sizes
        )
        return held_slopes, needed_slopes, curved


def _or_infinite(values: FloatArray) -> FloatArray:
    return np.where(np.isfinite(values), values, np.inf)


# A proved bound is at most this part above a value that is reached somewhere.
TIGHTNESS = 2e-4

# Rounding errors are far below this part of a quantity.
ROUNDING = 1e-9

# Cells along each side at first, and how often they are halved.
FIRST_CELLS = 8
MOST_HALVINGS = 40

# Most cells that are looked at together; a quantity that needs more has no bound.
MOST_CELLS = 200_000

# From the center of a cell to those of its quarters, in half sides of a quarter.
_TO_QUARTERS = np.array([(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)])

# Places, shape (n, 2), and the radius of the cells about them; returns bounds, shape (k, n).
Bounds = Callable[[FloatArray, float], FloatArray]


class Extremes(NamedTuple):
    """Largest values of some quantities over a volume.

    Attributes:
        bounds: which are nowhere exceeded; infinite where nothing is proved. Shape (k,).
        values: that are reached. Shape (k,).
        places: where, x and y. Shape (k, 2) [m].
    """

    bounds: FloatArray
    values: FloatArray
    places: FloatArray


def quartered(centers: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the four quarters of each cell: their centers, shape (4 n, 2), and half sides.

    Args:
        centers: of the cells. Shape (n, 2) [m].
        half: half of their sides. Shape (2,) [m].
    """
    half = 0.5 * half
    return (centers[:, np.newaxis] + half * _TO_QUARTERS).reshape(-1, 2), half


def largest_over(volume: Volume, quantities: Bounds, tightness: float = TIGHTNESS) -> Extremes:
    """Return the largest values of some quantities, which do not depend on the height.

    Args:
        volume: convex.
        quantities: bounds of them around places of the volume.
        tightness: largest part by which a bound is above the value.
    """
    lower, upper = level_box(volume)
    half = 0.5 * (upper - lower) / FIRST_CELLS
    steps = np.arange(1.0, 2.0 * FIRST_CELLS, 2.0)
    centers = np.stack(np.meshgrid(*(lower[:, np.newaxis] + half[:, np.newaxis] * steps)), axis=-1)
    centers = centers.reshape(-1, 2)
    found = quantities(nearest_inside(volume, centers[:1]), 0.0)[:, 0]
    places = np.tile(nearest_inside(volume, centers[:1]), (len(found), 1))
    bounds = found.copy()
    for _ in range(MOST_HALVINGS):
        radius = float(np.hypot(*half))
        # The part of a cell that is inside is no farther from the nearest place inside than the
        # cell's own places are from its center.
        inside = nearest_inside(volume, centers)
        touches = np.hypot(*(centers - inside).T) <= radius
        centers, inside = centers[touches], inside[touches]
        values = quantities(inside, 0.0)
        best = values.argmax(axis=1)
        for k, index in enumerate(best):
            if values[k, index] > found[k]:
                found[k], places[k] = values[k, index], inside[index]
        reached = quantities(inside, radius)
        most = found * (1.0 + tightness)
        open_cells = (reached > most[:, np.newaxis]).any(axis=0)
        done = reached[:, ~open_cells]
        if done.shape[1]:
            bounds = np.maximum(bounds, done.max(axis=1))
        centers = centers[open_cells]
        if not len(centers):
            return Extremes(np.maximum(bounds, found) * (1.0 + ROUNDING), found, places)
        if 4 * len(centers) > MOST_CELLS:
            break
        centers, half = quartered(centers, half)
    return Extremes(np.full(len(found), np.inf), found, places)
