"""Files of recordings: what they mean, and where their mistakes are."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mutations import mutated
from soak import many, seed

from tri_glide_kinematics.calibration.ringdown import (
    Quantity,
    Recording,
    RecordingFileError,
    find_modes,
    load_recording,
    ringdown_report,
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
        ("t,x [m]\n0,1\n", "1 samples; there must be at least 2"),
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


RATE = 3200


def swing(samples: int = 1600) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers of samples at 3200 Hz, and a mode of 23 Hz beside the weight [m/s^2]."""
    rng = np.random.default_rng(3)
    numbers = np.arange(samples)
    times = numbers / RATE
    decay = np.exp(-0.06 * math.tau * 23.0 * times) * np.cos(math.tau * 23.0 * times)
    values = np.outer(decay, (4.0, -2.0, 0.5)) + rng.normal(0.0, 0.03, (samples, 3))
    return numbers, values + np.array((0.0, 0.0, 9.80665))


def written(head: str, rows, form: str, end: str = "", newline: str = "\n") -> str:
    return newline.join([*head.split("\n"), *(form.format(*row) for row in rows), end])


def own_format(times: np.ndarray, values: np.ndarray) -> str:
    return written("t [s], x [m/s2], y [m/s2], z [m/s2]", zip(times, *values.T), "{:.6f},{},{},{}")


def klipper(numbers: np.ndarray, values: np.ndarray, before: str = "") -> str:
    rows = zip(218.3541 + numbers / RATE, *(1000.0 * values).T)
    return written(before + "#time,accel_x,accel_y,accel_z", rows, "{:.6f},{:.6f},{:.6f},{:.6f}")


def reprap(numbers: np.ndarray, values: np.ndarray, overflows: int = 0) -> str:
    end = f"Rate {RATE}, overflows {overflows}\n"
    return written(
        "Sample,X,Y,Z", zip(numbers, *(values / 9.80665).T), "{},{:.4f},{:.4f},{:.4f}", end
    )


@pytest.mark.parametrize("gap", [slice(0, 0), slice(400, 520)], ids=["whole", "with a gap"])
def test_files_of_two_firmwares_tell_the_same_mode_as_our_own(tmp_path, gap):
    numbers, values = (np.delete(each, gap, axis=0) for each in swing())
    own = find_modes(loaded(tmp_path, own_format(numbers / RATE, values))).modes[0]
    assert own.frequency == pytest.approx(23.0, rel=2e-3)
    assert own.damping == pytest.approx(0.06, abs=2e-3)
    texts = {
        "klipper": klipper(numbers, values),
        "two lines of head": klipper(numbers, values, "##kalico: adxl345\n"),
        "reprap": reprap(numbers, values),
        "CR alone": reprap(numbers, values).replace("\n", "\r"),
        "BOM": "\ufeff" + klipper(numbers, values),
    }
    for name, text in texts.items():
        found = loaded(tmp_path, text)
        assert found.quantity is Quantity.ACCELERATION
        assert len(found.times) == len(numbers), name
        mode = find_modes(found).modes[0]
        assert mode.frequency == pytest.approx(own.frequency, rel=1e-4), name
        assert mode.damping == pytest.approx(own.damping, abs=1e-4), name
    report = ringdown_report(find_modes(found))
    assert ("Gaps: 1, the longest of 0.0378 s" in report) == (gap.start > 0)


def test_lost_samples_are_told(tmp_path):
    found = loaded(tmp_path, reprap(*swing(), overflows=3))
    assert found.between(0.1, 0.4).overflows == 3
    assert "OVERFLOWS: 3; each time samples were lost" in ringdown_report(find_modes(found))
    assert "OVERFLOWS" not in ringdown_report(find_modes(loaded(tmp_path, reprap(*swing()))))


def test_one_axis_of_a_firmware(tmp_path):
    found = loaded(tmp_path, "Sample,Z\n0,1\n1,2\nRate 1600, overflows 0\n")
    assert found.names == ("z",)
    assert found.times.tolist() == [0.0, 1.0 / 1600.0]
    assert found.values[:, 0] == pytest.approx((9.80665, 19.6133))


@pytest.mark.parametrize(
    ("head", "rows"),
    [
        ("time_ms, x [g]", "{:.3f}, {}"),
        ("timestamp_us;x_g", "{:.1f}e3;{}"),
        ("ms; x [g]", "{:.3f}; {}"),
    ],
)
def test_a_unit_may_stand_in_the_name(tmp_path, head, rows):
    text = written(head, ((2.5 * k, 1.0) for k in range(20)), rows)
    found = loaded(tmp_path, text)
    assert np.diff(found.times) == pytest.approx(2.5e-3)
    assert found.values[:, 0] == pytest.approx(9.80665)


@pytest.mark.parametrize(
    "row",
    [
        "2026-11-28T09:30:{:06.3f},1.5",
        "2026-11-28 09:30:{:06.3f}Z,1.5",
        '"2026-11-28T09:30:{:06.3f}+01:00","1.5"',
        "2026-11-28T09:30:{:06.3f};1,5",
    ],
)
def test_times_may_be_dates(tmp_path, row):
    text = written(
        "when, x [mm]".replace(",", ";" if ";" in row else ","),
        ((59.9 - 0.002 * k,) for k in range(9, -1, -1)),
        row,
    )
    found = loaded(tmp_path, text)
    assert found.times == pytest.approx(0.002 * np.arange(10))
    assert found.values[:, 0] == pytest.approx(1.5e-3)


def test_decimals_may_have_commas_where_semicolons_separate(tmp_path):
    found = loaded(tmp_path, "t [s];x [g]\n0,000;1,250\n0,002;-0,5\n")
    assert found.times.tolist() == [0.0, 0.002]
    assert found.values[:, 0] == pytest.approx((1.25 * 9.80665, -0.5 * 9.80665))


def test_a_recording_may_be_long_and_in_utf_16_but_modes_are_those_of_a_part(tmp_path):
    file = tmp_path / "long.csv"
    rows = "".join(f"{i},{i % 7}.5\n" for i in range(200_001))
    file.write_text("#time,accel_x\n" + rows, encoding="utf-16")
    found = load_recording(file)
    with pytest.raises(KinematicsError, match=r"200001 samples from 0 to 200000 s: .* --from"):
        find_modes(found)
    assert len(find_modes(found.between(10.0, 12.0)).recording.times) == 3


def test_a_unit_in_latin_1(tmp_path):
    file = tmp_path / "swing.csv"
    file.write_bytes("t [ms],x [µm]\n0,1\n1,2\n".encode("latin-1"))
    assert load_recording(file).values[:, 0] == pytest.approx((1e-6, 2e-6))


EACH_MS = "".join(f"{k},1\n" for k in range(20))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("freq,psd_x,psd_y,psd_z,psd_xyz\n5,1,1,1,1\n", "line 1: a spectrum over frequencies"),
        ("# of May\n#Freq,psd_x\n5,1\n", "line 2: a spectrum over frequencies"),
        ("time,x [g]\n" + EACH_MS, "column 1: has no unit, and intervals of 1 are no seconds of"),
        ("time,x [g]\n" + EACH_MS.replace(",", "00,"), "intervals of 100 are no seconds"),
        ("t [s];x [g]\n1;1,250\n2;1,500\n", "line 2: in '1;1,250' a comma may stand between"),
        ("t [s];x [g]\n1.5;1,25\n2.5;1,5\n", "line 2: in '1.5;1,25' a comma may"),
        ("t;x [g]\n2026-13-28T09:30:01;1\n", "line 2, column 1: '2026-13-28T09:30:01' is no time"),
        ("Sample,X\n0,1\n1,2\n", "line 3: is '1,2'; it must be as 'Rate 3200, overflows 0'"),
        ("Sample,X\nFailed to collect data from accelerometer\n", "line 2: is 'Failed to collect"),
        ("Sample,X\n0,1\n1,2\nRate 0, overflows 0\n", "line 4: is 'Rate 0, overflows 0'"),
        ("Sample,X\nRate 1600, overflows 0\n", "has a head and no row"),
    ],
)
def test_what_is_not_certain_is_refused_with_what_was_seen(tmp_path, text, words):
    with pytest.raises(RecordingFileError) as caught:
        loaded(tmp_path, text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_damaged_files_are_recordings_or_one_line(tmp_path):
    numbers, values = swing(40)
    texts = [
        klipper(numbers, values, "## two lines\n"),
        reprap(numbers, values, 2),
        own_format(numbers / RATE, values).replace(",", ";").replace(".", ","),
    ]
    file = tmp_path / "damaged.csv"
    for k in range(many(200)):
        rng = np.random.default_rng((seed(5), k))
        file.write_bytes(mutated(texts[k % len(texts)].encode(), rng))
        try:
            found = load_recording(file)
        except RecordingFileError as error:
            assert str(error).startswith(f"{file}: ")
            assert "\n" not in str(error)
        else:
            assert np.isfinite(found.values).all()
