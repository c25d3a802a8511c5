"""What is checked in all requests about mechanisms: their numbers, the crank angles of a trace."""

import math
import re
from array import array
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechanism_requests import example_2

from tri_glide_interfaces.msg import CrankSweep
from tri_glide_interfaces.srv import SolveFMechanism, SolveFourBar
from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.nodes.mechanism_node import LARGEST, check_numbers, column, crank_angles

BEYOND = "beyond the one before (all rise, or all fall)"


class TestNumbers:
    def test_what_is_wrong_is_named_by_its_place(self):
        request = SolveFMechanism.Request(mechanism=example_2())
        check_numbers(request)
        request.mechanism.platform[2].y = math.nan
        with pytest.raises(NotFiniteError, match=r"mechanism\.platform\[2\]\.y = nan"):
            check_numbers(request)
        request.mechanism = example_2(rod_lengths=[1.0, -math.inf, 1.0])
        with pytest.raises(NotFiniteError, match=r"mechanism\.rod_lengths\[1\] = -inf"):
            check_numbers(request)

    @pytest.mark.parametrize("value", [1.0000001 * LARGEST, -1e300])
    def test_what_no_machine_has_is_refused(self, value):
        with pytest.raises(OutOfBoundsError, match=r"crank_velocity = .* at most 1e\+09"):
            check_numbers(SolveFourBar.Request(crank_velocity=value))

    @given(st.lists(st.floats(), max_size=50))
    @settings(derandomize=True)
    def test_a_column_keeps_every_bit(self, values):
        numbers = np.array(values, dtype=np.float64)
        packed = column(numbers)
        assert isinstance(packed, array)
        assert packed.tobytes() == numbers.tobytes()

    def test_a_column_of_a_slice_is_that_slice(self):
        numbers = np.arange(12.0).reshape(4, 3)
        assert list(column(numbers[:, 1])) == [1.0, 4.0, 7.0, 10.0]


class TestCrankAngles:
    def test_even_steps_hold_both_ends(self):
        angles = crank_angles(CrankSweep(start_angle=3.0, end_angle=1.0, steps=4), 10, 1)
        assert angles.tolist() == [3.0, 2.5, 2.0, 1.5, 1.0]

    def test_angles_given_one_by_one_come_before_the_range(self):
        given = [0.5, 0.0, -2.0]
        sweep = CrankSweep(start_angle=3.0, end_angle=1.0, steps=4, crank_angles=given)
        assert crank_angles(sweep, 2, 1).tolist() == given

    @pytest.mark.parametrize(
        ("sweep", "text"),
        [
            (CrankSweep(end_angle=1.0), "steps = 0 must be from 1 to 1000"),
            (CrankSweep(end_angle=1.0, steps=1001), "steps = 1001 must be from 1 to 1000"),
            (CrankSweep(crank_angles=[1.0]), "len(crank_angles) - 1 = 0 must be from 1 to 1000"),
            (CrankSweep(crank_angles=[0.0] * 1002), "len(crank_angles) - 1 = 1001 must be"),
            (CrankSweep(crank_angles=[0.0, 1.0, 0.5]), f"[2] = 0.5 rad must be {BEYOND}, 1 rad"),
            (CrankSweep(crank_angles=[0.0, -1.0, 0.0]), f"[2] = 0 rad must be {BEYOND}, -1 rad"),
            (CrankSweep(crank_angles=[0.0, 0.0]), f"crank_angles[1] = 0 rad must be {BEYOND}, 0"),
            (CrankSweep(crank_angles=[0.0, math.nan]), "crank_angles[1] = nan"),
            (CrankSweep(crank_angles=[-math.inf, 0.0]), "crank_angles[0] = -inf"),
            (CrankSweep(crank_angles=[0.0, 1e10]), "crank_angles[1] = 1e+10 must be at most 1e+09"),
            (CrankSweep(end_angle=10.01 * math.tau, steps=1), "crank angle = 10.01 turns must be"),
        ],
    )
    def test_a_sweep_that_cannot_be_served_is_refused(self, sweep, text):
        with pytest.raises(KinematicsError) as caught:
            crank_angles(sweep, 1000, 10)
        assert text in str(caught.value)


class TestInterfaceFiles:
    FOLDER = Path(__file__).parents[3] / "tri_glide_interfaces"
    DIMENSIONLESS = (
        *("tolerance", "singularity", "turns", "speed_scale", "path_speed_scale"),
        *("dampings", "damping_deviations"),
    )

    def test_every_number_says_its_unit(self):
        """Which stands first in the comment behind the field, or on the line above it."""
        numbers = 0
        for path in sorted(self.FOLDER.glob("*/*.[ms][sr][gv]")):
            before = ""
            for line in path.read_text().splitlines():
                field = re.match(r"float64\S* (\w+)", line)
                if field and field[1] not in self.DIMENSIONLESS:
                    comment = line.partition("#")[2] or before.lstrip("#")
                    unit = re.match(r" (m|rad|kg|N|s|Hz)\b|( likewise$| as in )", comment)
                    assert unit, f"{path.name}: {line}"
                    numbers += 1
                before = line
        assert numbers > 130
