"""Files of recordings: what they mean, and where their mistakes are."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tri_glide_kinematics.calibration.ringdown import (
    Quantity,
    Recording,
    RecordingFileError,
    load_recording,
    save_recording,
)
from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, WrongShapeError


def loaded(tmp_path, text: str, unit: str | None = None) -> Recording:
    file = tmp_path / "swing.csv"
    file.write_text(text, encoding="utf-8")
    return load_recording(file, unit)


@pytest.mark.parametrize(
    ("head", "quantity", "time", "scale"),
    [
        ("t [s], x [m]", Quantity.POSITION, 1.0, 1.0),
        ("t (ms), x (um)", Quantity.POSITION, 1e-3, 1e-6),
        ("t[us];x[µm]", Quantity.POSITION, 1e-6, 1e-6),
        ("t, x [g]", Quantity.ACCELERATION, 1.0, 9.80665),
        ("stamp [ns]\tx [m/s^2]", Quantity.ACCELERATION, 1e-9, 1.0),
        ('"t [s]","x [mg]"', Quantity.ACCELERATION, 1.0, 9.80665e-3),
    ],
)
def test_units_stand_in_the_head(tmp_path, head, quantity, time, scale):
    sign = next(sign for sign in ";\t," if sign in head)
    found = loaded(tmp_path, f"# a remark\n\n{head}\n1{sign}2\n3{sign}-4.5e0\n")
    assert found.quantity is quantity
    assert found.times == pytest.approx((time, 3.0 * time))
    assert found.values[:, 0] == pytest.approx((2.0 * scale, -4.5 * scale))
    assert found.names == ("x",)


def test_a_unit_may_be_given_and_that_of_the_head_wins(tmp_path):
    assert loaded(tmp_path, "t, x, y\n0,1,2\n1,3,4\n", "mm").values[1, 1] == pytest.approx(4e-3)
    assert loaded(tmp_path, "t, x [m]\n0,1\n1,3\n", "mm").values[1, 0] == 3.0


def test_a_line_with_an_empty_cell_is_a_missing_sample(tmp_path):
    found = loaded(tmp_path, "t, x [mm], y [mm]\n0,1,1\n1,,2\n2,3,3\n")
    assert found.times.tolist() == [0.0, 2.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t\n1\n2\n", "line 1: 1 columns; there must be a time and 1 to 3 axes"),
        ("t,a,b,c,d\n0,1,2,3,4\n", "line 1: 5 columns"),
        ("0,1\n1,2\n", "line 1: no head; there must be a time"),
        ("t [s],x\n0,1\n1,2\n", "line 1, column 2: has no unit"),
        ("t [h],x [m]\n0,1\n1,2\n", "line 1, column 1: 'h' is no unit"),
        ("t,x [inch]\n0,1\n1,2\n", "line 1, column 2: 'inch' is no unit"),
        ("t,x [m],y [g]\n0,1,1\n", "line 1: positions and accelerations in one file"),
        ("t,x [m]\n0,1\n\n1,two\n", "line 4, column 2: 'two' is not a number"),
        ("t,x [m]\n0,1\n# no\n0,2\n", "line 4, column 1: 0 must be greater than the one before"),
        ("t,x [m]\n0,1\n", "1 samples; there must be 2 to 200000"),
    ],
)
def test_a_mistake_is_named_with_its_place(tmp_path, text, words):
    with pytest.raises(RecordingFileError) as caught:
        loaded(tmp_path, text)
    assert words in str(caught.value)
    assert "swing.csv" in str(caught.value)


def test_a_file_that_cannot_be_read_is_an_error(tmp_path):
    with pytest.raises(RecordingFileError, match="No such file"):
        load_recording(tmp_path / "none.csv")


@settings(derandomize=True, deadline=None, max_examples=200)
@given(st.text(alphabet='t,;x[m] \n"0123.e-#\x00', max_size=60))
def test_any_text_is_a_recording_or_a_clear_error(tmp_path_factory, text):
    try:
        found = loaded(tmp_path_factory.getbasetemp(), text)
    except RecordingFileError:
        return
    assert np.isfinite(found.values).all()


def test_a_recording_checks_its_numbers():
    with pytest.raises(WrongShapeError):
        Recording(np.arange(3.0), np.zeros((2, 1)))
    with pytest.raises(WrongShapeError):
        Recording(np.arange(3.0), np.zeros((3, 4)))
    with pytest.raises(WrongShapeError):
        Recording(np.arange(3.0), np.zeros((3, 2)), names=("x",))
    with pytest.raises(NotFiniteError):
        Recording(np.arange(3.0), np.array([[0.0], [math.nan], [0.0]]))
    with pytest.raises(KinematicsError, match=r"times\[2\] = 1 s must be greater"):
        Recording(np.array([0.0, 1.0, 1.0]), np.zeros((3, 1)))


def test_a_part_of_a_recording():
    whole = Recording(np.arange(10.0), np.arange(10.0)[:, None])
    assert whole.between(2.0, 4.0).times.tolist() == [2.0, 3.0, 4.0]
    with pytest.raises(KinematicsError, match="from 20 to 30 s there are 0 samples"):
        whole.between(20.0, 30.0)


@pytest.mark.parametrize("quantity", list(Quantity))
def test_a_recording_that_was_written_is_read_again(tmp_path, quantity):
    rng = np.random.default_rng(1)
    # Stamps are seconds since 1970.
    times = 1.79e9 + np.cumsum(rng.uniform(1e-3, 3e-3, 50))
    recording = Recording(times, rng.standard_normal((50, 3)), quantity, ("a", "b", "c"))
    file = tmp_path / "swing.csv"
    save_recording(file, recording, "of a test")
    found = load_recording(file)
    assert found.times == pytest.approx(times - times[0], abs=1e-7)
    assert found.values == pytest.approx(recording.values, rel=1e-8)
    assert (found.quantity, found.names) == (quantity, ("a", "b", "c"))
    assert "# of a test" in file.read_text()
    # An older one is kept, and what is none of ours stays.
    save_recording(file, recording, "again")
    assert (tmp_path / "swing.csv.bak").exists()
    other = tmp_path / "other.csv"
    other.write_text("mine")
    with pytest.raises(RecordingFileError, match="its first line is not"):
        save_recording(other, recording)
