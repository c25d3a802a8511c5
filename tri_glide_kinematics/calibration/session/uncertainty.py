"""How well the platform's position is known over the workspace, before and after a calibration."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.calibration.fit.region import Region
from tri_glide_kinematics.calibration.fit.result import Calibration
from tri_glide_kinematics.vectors import FloatArray

# Places lie on this many rings about the centre.
RINGS = 8


@dataclass(frozen=True, eq=False)
class UncertaintyMap:
    """Standard deviations of x, y and z over a disc; they do not depend on z.

    Attributes:
        region: the disc with its n places.
        before: by what was assumed. Shape (n, 3) [m]; infinite where nothing is known.
        after: by the calibration. Shape (n, 3) [m].
        aligned: the same, if a shift in x and y and a turn about z do not matter. Shape (n, 3) [m].
    """

    region: Region
    before: FloatArray
    after: FloatArray
    aligned: FloatArray

    @classmethod
    def of(cls, calibration: Calibration) -> UncertaintyMap:
        """Return the map of a ``calibration``."""
        whole = Region.of(calibration.geometry)
        region = Region.disc(whole.center, whole.radius, RINGS)
        return cls(
            region,
            calibration.position_uncertainties_before(region.places),
            calibration.position_uncertainties(region.places),
            calibration.position_uncertainties(region.places, aligned=True),
        )
