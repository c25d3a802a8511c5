"""Settings of firmwares: their own formulas, there and back, and damaged files."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from firmware_files import SAMPLES, Marlin, Sample
from mutations import mutated
from soak import many, seed

from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares import (
    Firmware,
    FirmwareError,
    firmware_text,
    load_firmware_settings,
    load_parameters,
    parameter_text,
)
from tri_glide_kinematics.settings import machine_of, sections_of
from tri_glide_kinematics.tri_glide import TriGlide

MM = 1e-3
NEAR = 1e-12  # m
FIRMWARES = [each.value for each in Firmware]

each_sample = pytest.mark.parametrize("sample", SAMPLES.values(), ids=SAMPLES)


def places(sample: Sample, count: int = 40) -> np.ndarray:
    """Return places of the nozzle near the axis, x, y, z [mm]."""
    rng = np.random.default_rng(3)
    top = min(sample.delta.end_stops()) - max(sample.delta.carriages(0.0, 0.0, 0.0))
    return rng.uniform((-60.0, -60.0, 0.0), (60.0, 60.0, 0.9 * top), (count, 3))


def check_poses(sample: Sample, machine: MachineParameters, shift=(0.0, 0.0)) -> None:
    """Check that reported heights mean what the firmware's formulas say."""
    robot = TriGlide(machine.geometry)
    for x, y, z in places(sample):
        heights = MM * np.array(sample.delta.carriages(x, y, z)) + machine.height_offsets
        found = robot.forward(heights) + np.array([*shift, 0.0])
        np.testing.assert_allclose(found, MM * np.array([x, y, z]), rtol=0.0, atol=NEAR)


@pytest.fixture
def files(tmp_path):
    """Return a function that writes a text into a file, and returns its path."""

    def written(text: str, name: str = "machine.yaml") -> Path:
        file = tmp_path / name
        file.write_text(text)
        return file

    return written


@each_sample
def test_poses_are_those_of_the_firmware(sample, tmp_path):
    settings = load_firmware_settings(sample.write(tmp_path))
    assert settings.firmware.value == sample.firmware
    assert settings.machine.height_offsets == (0.0, 0.0, 0.0)
    check_poses(sample, settings.machine)
    ends = MM * np.array(sample.delta.end_stops())
    np.testing.assert_allclose(settings.end_stops, ends, rtol=0.0, atol=NEAR)
    for words in sample.notes:
        assert any(words in note for note in settings.notes), settings.notes
    assert len(settings.notes) == len(sample.notes), settings.notes


@each_sample
def test_a_parameter_file_holds_the_machine_and_its_limits(sample, tmp_path, files):
    settings = load_firmware_settings(sample.write(tmp_path))
    values, origin = load_parameters(files(parameter_text(settings)))
    check_poses(sample, MachineParameters(machine_of(values).geometry, values["height_offsets"]))
    ends = MM * np.array(sample.delta.end_stops())
    np.testing.assert_allclose(values["upper_heights"], ends, rtol=0.0, atol=NEAR)
    for name, value in sample.parameters.items():
        assert values[name] == pytest.approx(value, abs=1e-15), name
    assert origin.firmware is settings.firmware


@each_sample
def test_there_and_back_no_text_changes(sample, tmp_path, files):
    settings = load_firmware_settings(sample.write(tmp_path))
    file = files(parameter_text(settings))
    lines = firmware_text(*load_parameters(file), settings.firmware)
    back = load_firmware_settings(files(lines, "back.txt"), firmware=settings.firmware)
    assert back.towers == settings.towers
    assert back.limits == settings.limits
    assert back.probe_offset == settings.probe_offset
    for name in settings.used:
        assert settings.said[name].text == back.said[name].text, name
    # Once more, from those lines.
    assert firmware_text(*load_parameters(files(parameter_text(back))), back.firmware) == lines


@each_sample
@pytest.mark.parametrize("other", FIRMWARES)
def test_lines_of_another_firmware_are_the_same_machine(sample, other, tmp_path, files):
    settings = load_firmware_settings(sample.write(tmp_path))
    values, _ = load_parameters(files(parameter_text(settings)))
    lines = firmware_text(values, None, Firmware(other))
    back = load_firmware_settings(files(lines, "back.txt"), firmware=Firmware(other))
    told = re.search(r"plus \((.*), (.*)\) mm", lines)
    shift = [MM * float(number) for number in told.groups()] if told else (0.0, 0.0)
    # The firmware's x and y are shifted where the towers are not at one distance; to 1 nm as told.
    robot, ours = TriGlide(back.machine.geometry), TriGlide(settings.machine.geometry)
    for place in MM * places(sample):
        found = robot.forward(ours.inverse(place))
        near = 1e-9 if told else NEAR
        np.testing.assert_allclose(found, place + np.array([*shift, 0.0]), rtol=0.0, atol=near)
    np.testing.assert_allclose(back.end_stops, settings.end_stops, rtol=0.0, atol=NEAR)


@each_sample
def test_after_a_calibration_the_geometry_is_new_and_the_rest_stays(sample, tmp_path, files):
    settings = load_firmware_settings(sample.write(tmp_path))
    file = files(parameter_text(settings))
    arms = np.add(settings.machine.geometry.arm_lengths, (0.0002, -0.0001, 0.0003)).tolist()
    numbers = {"arm_lengths": arms, "height_offsets": [0.0003, 0.0, -0.0001]}
    later = files(yaml.safe_dump({"/**": {"ros__parameters": numbers}}), "calibrated.yaml")
    lines = firmware_text(*load_parameters(file, later), settings.firmware)
    back = load_firmware_settings(files(lines, "back.txt"), firmware=settings.firmware)
    assert back.limits == settings.limits
    assert back.probe_offset == settings.probe_offset
    assert back.machine.geometry.arm_lengths == pytest.approx(arms, abs=NEAR)
    expected = np.add(settings.end_stops, numbers["height_offsets"])
    np.testing.assert_allclose(back.end_stops, expected, rtol=0.0, atol=NEAR)
    typed = re.search("// Typed.*: (M665 .*)\n// and (M666 .*)\n", lines)
    assert bool(typed) is (sample.firmware == "marlin")
    if typed:
        printed = files(f"{typed[1]}\n{typed[2]}\nM851 Z{back.probe_offset}\n", "typed.txt")
        same = load_firmware_settings(printed, firmware=Firmware.MARLIN)
        assert same.machine.vector == pytest.approx(back.machine.vector, abs=NEAR)
        assert same.end_stops == pytest.approx(back.end_stops, abs=NEAR)


def test_a_number_that_is_written_with_an_exponent_is_one(tmp_path, files):
    file = SAMPLES["kossel"].write(tmp_path)
    text = file.read_text()
    file.write_text(text.replace("minimum_z_position: -5", "minimum_z_position: 0.05"))
    assert file.read_text() != text
    values, _ = load_parameters(files(parameter_text(load_firmware_settings(file))))
    assert values["cylinder_z"][0] == 5e-5


def test_of_what_marlin_prints_a_new_reach_changes_no_rod(tmp_path, files):
    settings = load_firmware_settings(SAMPLES["m503"].write(tmp_path))
    file = files(parameter_text(settings))
    numbers = {"cylinder_radius": 0.08}
    later = files(yaml.safe_dump({"/**": {"ros__parameters": numbers}}), "small.yaml")
    lines = firmware_text(*load_parameters(file, later), Firmware.MARLIN)
    assert "B-0.03" in lines
    assert "#define PRINTABLE_RADIUS 80\n" in lines


def test_new_limits_change_their_lines_alone(tmp_path, files):
    settings = load_firmware_settings(SAMPLES["overridden"].write(tmp_path))
    file = files(parameter_text(settings))
    numbers = {"platform_speed_limit": 0.25, "cylinder_radius": 0.08}
    later = files(yaml.safe_dump({"/**": {"ros__parameters": numbers}}), "slow.yaml")
    lines = firmware_text(*load_parameters(file, later), Firmware.REPRAP).splitlines()
    before = firmware_text(*load_parameters(file), Firmware.REPRAP).splitlines()
    assert set(lines) - set(before) == {
        "M665 R105.603 L215.000:215.107:214.950 X0.213 Y-0.402 Z0.000 H250.104 B80",
        "M203 X15000 Y15000 Z15000",
    }


def test_a_machine_of_this_suite_as_lines(tmp_path):
    file = Path(__file__).parents[2] / "config" / "tri_glide.yaml"
    values, origin = load_parameters(file)
    assert origin is None
    lines = firmware_text(values, origin, Firmware.REPRAP)
    assert "; Towers A, B, C are arms 2, 3, 1." in lines
    assert "M665 L400:400:400 R200 " in lines
    assert "M203 X60000 Y60000 Z60000" in lines
    marlin = firmware_text(values, origin, Firmware.MARLIN)
    assert "add its offset along z to DELTA_HEIGHT" in marlin


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("override", "A0.00", "A0.25", "line 5: M666 A = 0.25 must be 0: a bed that is tilted"),
        ("override", "B0.00", "B-1", "M666 B = -1 must be 0"),
        ("override", "R105.603", "R{global.radius}", "line 4: M665 R is '{GLOBAL.RADIUS}'"),
        ("override", "R105.603", "", "M665 R is missing"),
        ("override", "L215.000:215.107:214.950", "L215:215", "M665 L is missing, or has neither"),
        ("override", "L215.000", "L90", "M665 L is '90:215.107:214.950', must be a number greater"),
        ("duet", "M665", "  M665", "line 10: M665 depends on a condition"),
        ("duet", "G90 ", "G20 ", "G20 (inches)"),
        ("macro", "K3", "K1", "M669 K must be 3"),
        ("macro", "M665 L300.5", 'M98 P"config.g"\nM665 L300.5', "leads in a circle"),
        ("marlin", "250.00 //", "25O.00 //", "DELTA_HEIGHT is '25O.00', must be a number"),
        ("marlin", "250.00 //", "(250 / 0) //", "DELTA_HEIGHT is '(250 / 0)'"),
        ("marlin", "250.00 //", "9**9**9 //", "DELTA_HEIGHT is '9**9**9'"),
        ("marlin", "250.00 //", "DELTA_HEIGHT //", "DELTA_HEIGHT is 'DELTA_HEIGHT'"),
        ("marlin", "#define DELTA\n", "//#define DELTA\n", "it is of no delta"),
        ("marlin", "#if ENABLED(DELTA)", "#if DELTA > 1", "(if line "),
        ("marlin", "// (degrees)\n", "// (degrees)\n#if 1\n", "#if has no #endif: is it cut off?"),
        ("marlin", "// @section delta", "#endif", "line 28: #endif has no #if"),
        ("marlin", "{ 0.12, -0.08, 0.0 }", "{ 0.12, -0.08 }", "has 2 numbers, must have three"),
        ("kossel", "kinematics: delta", "kinematics: corexy", "printer.kinematics is 'corexy'"),
        ("kossel", "delta_radius: 174.75", "", "printer.delta_radius is missing"),
        ("kossel", "delta_radius: 174.75", "delta_radius: -1", "must be a number greater than 0"),
        ("kossel", "arm_length: 333.0 ;", "arm_length: 100 ;", "greater than 174.75"),
        ("kossel", "[mcu]", "[bed_tilt]\nx_adjust: 0.01\n[mcu]", "bed_tilt.x_adjust = 0.01"),
        ("kossel", "[mcu]", "[include none.cfg]\n[mcu]", "[include none.cfg]: there is no such"),
        ("kossel", "[mcu]", "[include p*.cfg]\n[mcu]", "[include p*.cfg]: leads in a circle"),
        ("kossel", "[mcu]", "nonsense\n[mcu]", "[line "),
        ("saved", "#*# height0 = 0.0", "height0 = 0.0", "below SAVE_CONFIG a line must begin"),
        ("saved", "SAVE_CONFIG --", "SAVE --", "begins with #*#, above any SAVE_CONFIG"),
        ("saved", "arm_length = 215.017001", "arm_length = 2150000", "no machine of this suite"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(name, old, new, words, tmp_path):
    sample = SAMPLES[name]
    assert any(old in text for text in sample.files.values())
    changed = {file: text.replace(old, new) for file, text in sample.files.items()}
    path = Sample(sample.firmware, changed, sample.delta, encoding=sample.encoding).write(tmp_path)
    with pytest.raises(FirmwareError) as raised:
        parameter_text(load_firmware_settings(path))
    assert words in str(raised.value)
    assert str(raised.value).startswith(str(tmp_path))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("marlin", "250.00 //", "(1 + 999 / 2.0 - 0.5) / +2 //"),
        # In C, 501 / 2 is 250, and a name stands for its text.
        ("marlin", "250.00 //", "HALF * 2\n#define HALF 501 / 2 - 125 + 62.5f //"),
        ("override", "R105.603", "R{(211 + 0.206) / 2}"),
        ("override", "L215.000:215.107:214.950", "L{430 / 2}:215.107:{214.950}"),
    ],
)
def test_numbers_may_be_arithmetic(name, old, new, tmp_path):
    sample = SAMPLES[name]
    changed = {file: text.replace(old, new) for file, text in sample.files.items()}
    assert changed != sample.files
    path = Sample(sample.firmware, changed, sample.delta, encoding=sample.encoding).write(tmp_path)
    check_poses(sample, load_firmware_settings(path).machine)


def test_a_file_of_nobody_is_refused(tmp_path):
    file = tmp_path / "notes.txt"
    file.write_text("M665 R100 L200 H200\n")
    with pytest.raises(FirmwareError, match="name it with --from"):
        load_firmware_settings(file)
    for each in (Firmware.MARLIN, Firmware.REPRAP):
        assert load_firmware_settings(file, firmware=each).towers.radii == (100.0,) * 3
    with pytest.raises(FirmwareError, match=r"none\.cfg: cannot be read: No such file"):
        load_firmware_settings(tmp_path / "none.cfg")
    with pytest.raises(FirmwareError, match="cannot be read: Is a directory"):
        load_firmware_settings(tmp_path)
    file.write_bytes(b"\0\1\2")
    with pytest.raises(FirmwareError, match="is no text"):
        load_firmware_settings(file)


def test_what_marlin_prints_wins_over_its_header(tmp_path):
    header = SAMPLES["trimmed"].write(tmp_path)
    printed = SAMPLES["m503"].write(tmp_path)
    settings = load_firmware_settings(header, printed)
    delta = Marlin(
        283.86,
        98.92,
        217.95,
        (-0.43, 0.0, -0.17),
        (0.18, 0.31, 0.0),
        (0.31, -0.2, 0.05),
        (0.02, -0.03, 0.0),
        -16.8,
    )
    check_poses(Sample("marlin", {}, delta), settings.machine)
    assert not any("DELTA_RADIUS_TRIM" in note for note in settings.notes)


def test_older_names_of_trims_and_other_logs_of_hosts(tmp_path):
    file = tmp_path / "Configuration.h"
    file.write_text(
        "#define DELTA\n#define DELTA_HEIGHT 200\n#define DELTA_RADIUS 100\n"
        "#define DELTA_DIAGONAL_ROD 220\n#define DELTA_RADIUS_TRIM_TOWER_2 0.5\n"
        "#define DELTA_DIAGONAL_ROD_TRIM_TOWER_1 -0.25\n#define DELTA_TOWER_ANGLE_TRIM_3 0.1\n"
    )
    settings = load_firmware_settings(file)
    trims = {"radius_trims": (0.0, 0.5, 0.0), "rod_trims": (-0.25, 0.0, 0.0)}
    delta = Marlin(200.0, 100.0, 220.0, turns=(0.0, 0.0, 0.1), **trims)
    check_poses(Sample("marlin", {}, delta), settings.machine)
    log = tmp_path / "host.log"
    log.write_text(
        "12:01:02.345 > echo:  M665 L217.00 R98.00 S100.00 B90.00 X0.00 Y0.00 Z0.00\n"
        "12:01:02.345 > echo:Endstop adjustment (mm):\n12:01:02.346 > echo:  M666 X-0.10 Y0 Z0\n"
    )
    with pytest.raises(FirmwareError, match="M665 H or DELTA_HEIGHT or MANUAL_Z_HOME_POS is miss"):
        load_firmware_settings(log)
    both = load_firmware_settings(file, log)
    assert both.towers.arms == (216.75, 217.0, 217.0)
    assert both.towers.radii == (98.0, 98.5, 98.0)
    assert both.towers.heights == (200.1, 200.0, 200.0)
    assert any("radius of a calibration" in note for note in both.notes)


JUNK = ["", "-", "nan", "inf", "1e999", "1,5", "0", "-1", "{", "}", "[", "]", "\\", '"', "/*", "\0"]
JUNK += ["#if 1", "#endif", "[include *]", "M501", "M98 P", "#*#", "9" * 400, "é", "((((", "\x1b["]


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a content that something has happened to, some of it of this trade."""
    place, word = rng.integers(len(content) + 1), rng.choice(JUNK).encode("latin-1")
    put_in = content[:place] + word + content[place:]
    return mutated(put_in if rng.random() < 0.3 else content, rng)


@pytest.mark.filterwarnings("error")
def test_damaged_parameter_files_get_one_line_on_the_way_back(tmp_path):
    rng = np.random.default_rng(seed(51))
    texts = {}
    for name in ("saved", "trimmed", "overridden"):
        settings = load_firmware_settings(SAMPLES[name].write(tmp_path / name))
        texts[settings.firmware] = parameter_text(settings)
    file = tmp_path / "machine.yaml"
    refused = 0
    for _ in range(many(150)):
        firmware = list(texts)[rng.integers(len(texts))]
        file.write_bytes(damaged(texts[firmware].encode(), rng))
        # What is read of a file stays known.
        sections_of.cache_clear()
        try:
            firmware_text(*load_parameters(file), list(Firmware)[rng.integers(3)])
        except KinematicsError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused > many(30)


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_damaged_files_get_one_line_with_the_file(tmp_path):
    rng = np.random.default_rng(seed(50))
    samples = [sample.write(tmp_path / name) for name, sample in SAMPLES.items()]
    texts = {}
    for path in samples:
        for file in path.parent.rglob("*.*"):
            if file.is_file():
                texts[path, file] = file.read_bytes()
    refused = 0
    for _ in range(many(400)):
        path, file = list(texts)[rng.integers(len(texts))]
        file.write_bytes(damaged(texts[path, file], rng))
        try:
            parameter_text(load_firmware_settings(path))
        except FirmwareError as error:
            refused += 1
            assert str(error).startswith(str(path.parent)), error
            assert len(str(error).splitlines()) == 1
            assert len(str(error)) < 600
        finally:
            file.write_bytes(texts[path, file])
    assert refused > many(80)
