"""What three firmwares print of a machine that is known: it is found again."""

import math
import re

import numpy as np
import pytest
from firmware_files import FOLDER
from mutations import mutated
from soak import many, seed

from testing.wrong_machines import ring
from tri_glide_kinematics.calibration import MachineParameters, Priors
from tri_glide_kinematics.calibration.fit import NoMachineThereError
from tri_glide_kinematics.calibration.session import solved
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares import (
    FirmwareError,
    check_no_log,
    load_firmware_settings,
    load_log,
)
from tri_glide_kinematics.firmwares.towers import towers_of
from tri_glide_kinematics.tri_glide import TriGlide

MM = 1e3

# A kit as its settings say it is, in each firmware.
PRINTER, CONFIGURATION, CONFIG_G = (
    (FOLDER / name).read_text() for name in ("kit.cfg", "kit_Configuration.h", "kit_config.g")
)


class Printer:
    """A machine that is not as its settings say.

    Attributes:
        settings: of its firmware.
        true: the machine as it is, with the heights of the settings as reported ones.
    """

    def __init__(self, folder, name: str, text: str, number: int = 3) -> None:
        self.file = folder / name
        self.file.write_text(text)
        self.settings = load_firmware_settings(self.file)
        self.believed = TriGlide(self.settings.machine.geometry)
        self.rng = np.random.default_rng(number)
        nominal = self.settings.machine.vector
        changes = Priors().covariance(nominal)
        vector = self.rng.multivariate_normal(nominal, changes)
        self.true = MachineParameters.from_vector(vector)

    def place(self, x: float, y: float, z: float) -> np.ndarray:
        """Return where the nozzle really is, where the firmware thinks it is there [mm]."""
        heights = np.add(self.believed.inverse((x / MM, y / MM, z / MM)), self.true.height_offsets)
        return MM * np.array(TriGlide(self.true.geometry).forward(heights))

    def height(self, x: float, y: float, offset=(0.0, 0.0), noise: float = 0.01) -> float:
        """Return the height at which the firmware thinks that the probe touches the bed [mm]."""
        z = 0.0
        for _ in range(20):
            z -= self.place(x - offset[0], y - offset[1], z)[2]
        return z + noise * self.rng.standard_normal()

    def stable(self, x: float, y: float, z: float) -> str:
        """Return a place as Klipper keeps it: in steps below the end stops."""
        heights = self.believed.inverse((x / MM, y / MM, z / MM))
        steps = [
            MM * (end - height) * 80.0 for end, height in zip(self.settings.end_stops, heights)
        ]
        return ",".join(f"{each:.3f}" for each in steps)

    def delta_calibrate(self) -> str:
        """Return what SAVE_CONFIG appends."""
        lines = ["", "#*# <---------------------- SAVE_CONFIG ---------------------->"]
        lines += ["#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.", "#*#"]
        lines += ["#*# [delta_calibrate]"]
        for i, (x, y) in enumerate((*[(0.0, 0.0)] * 2, *ring(80.0, 9), *ring(45.0, 3))):
            # The probe triggers 1.85 mm above the bed.
            z = self.height(x, y) + 1.85
            lines += [f"#*# height{i} = 1.85", f"#*# height{i}_pos = {self.stable(x, y, z)}"]
        z = self.height(10.0, 60.0)
        lines += ["#*# manual_height0 = 0.0", f"#*# manual_height0_pos = {self.stable(10, 60, z)}"]
        for i, (x, y) in enumerate(ring(65.0, 3, 0.3)):
            ends = (x, y, 0.1), (-x, -y, 0.1)
            length = math.dist(*(self.place(*end) for end in ends)) + 0.03 * self.rng.normal()
            lines += [f"#*# distance{i} = {length:.6f}"]
            lines += [
                f"#*# distance{i}_pos{k} = {self.stable(*end)}" for k, end in enumerate(ends, 1)
            ]
        return "\n".join(lines) + "\n"

    def g33(self, command: str, radius: float, printed: bool = False, start: str = "") -> str:
        """Return what Marlin prints of a dry run."""
        angles = {"x": 210, "y": 330, "z": 90, "yz": 30, "zx": 150, "xy": 270}
        if "P2" in command:
            angles = dict(list(angles.items())[:3])

        def height(angle: float, part: float = 1.0) -> float:
            turn, r = math.radians(angle), part * radius
            return self.height(r * math.cos(turn), r * math.sin(turn))

        middle = [height(angle, 0.1) for angle in (210, 330, 90)]
        c = np.mean(middle) if "P3" in command else self.height(0.0, 0.0)
        found = {name: height(angle) for name, angle in angles.items() if "P1" not in command}
        texts = [f"{name}:{z:+.2f}" for name, z in found.items()]
        at = f" at radius:{radius:.2f}" if printed else ""
        return "\n".join(
            [
                f"Send: {command}",
                "Recv: G33 Auto Calibrate",
                f"Recv: Checking... AC{at} (DRY-RUN)",
                start or "Recv: .Height:297.05    Ex:+0.00  Ey:-0.30  Ez:-0.10    Radius:104.20",
                "Recv: .                 Tx:+0.00  Ty:+0.00  Tz:+0.00",
                f"Recv: .      c:{c:+.2f}     " + "    ".join(texts[:3]),
                f"Recv: .                 {'   '.join(texts[3:])}",
                "Recv: End DRY-RUN                                   std dev:0.412",
                "Recv: ok",
                "",
            ]
        )

    def height_map(self, version: int) -> str:
        heads = (
            "axis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1\nX,Y,",
            "xmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum\n",
        )
        lines = [
            "RepRapFirmware height map file v2 generated at 2026-11-28 09:30, min error -0.1",
            f"{heads[version]}-80.00,80.10,-80.00,80.10,80.00,20.00,20.00,9,9",
        ]
        for y in range(-80, 81, 20):
            row = []
            for x in range(-80, 81, 20):
                z = self.height(x, y, (3.0, -4.0)) if math.hypot(x, y) <= 81.0 else None
                row.append("      0" if z is None else f"{z:7.3f}")
            lines.append(",".join(row))
        return "\n".join(lines) + "\n"

    def g32(self) -> tuple[str, str]:
        """Return what G32 prints, and bed.g."""
        places = [(0.0, 0.0), *ring(80.0, 9), *ring(45.0, 6)]
        bed = [f"G30 P{i} X{x:.2f} Y{y:.2f} H0 Z-99999" for i, (x, y) in enumerate(places)]
        heights = [
            self.height(float(f"{x:.2f}"), float(f"{y:.2f}"), (3.0, -4.0)) for x, y in places
        ]
        text = " ".join(f"{z:.3f}" for z in heights)
        said = f"G32\nG32 bed probe heights: {text}, mean 0.012, deviation from mean 0.2\n"
        return said, "M561 ; clear\nG28\n" + "\n".join(bed) + " S-1 ; report\n"


def log_of(folder, kind: str, number: int) -> tuple[Printer, list]:
    texts: list[str] = []
    if kind == "klipper":
        printer = Printer(folder, "printer.cfg", PRINTER, number)
        printer.file.write_text(PRINTER + printer.delta_calibrate())
        return printer, [printer.file]
    if kind.startswith("marlin"):
        printer = Printer(folder, "Configuration.h", CONFIGURATION, number)
        if kind == "marlin G33":
            texts = [printer.g33("G33 P3 V0", 80.0)]
            texts += [printer.g33("G33 P3 V0 R40", 40.0), printer.g33("G33 P1 V0", 80.0, True)]
        else:
            places = [(0.0, 0.0), *ring(80.0, 9), *ring(45.0, 6)]
            rows = [(x, y, printer.height(x, y, (3.0, -4.0))) for x, y in places]
            texts = ["".join(f"Bed X: {x:.6f} Y: {y:.6f} Z: {z:.3f}\nok\n" for x, y, z in rows)]
    else:
        printer = Printer(folder, "config.g", CONFIG_G, number)
        texts = list(printer.g32()) if kind == "reprap G32" else [printer.height_map(number % 2)]
    files = [folder / f"log{i}.txt" for i, _ in enumerate(texts)]
    for file, text in zip(files, texts):
        file.write_text(text)
    return printer, files


@pytest.mark.parametrize("number", [3, 4, 5])
@pytest.mark.parametrize(
    "kind", ["klipper", "marlin G30", "marlin G33", "reprap map", "reprap G32"]
)
def test_a_machine_is_found_within_what_is_told(tmp_path, kind, number):
    printer, files = log_of(tmp_path, kind, number)
    with pytest.raises(FirmwareError, match="name its settings of that moment with --settings"):
        check_no_log(files[0])
    content, notes = load_log(files, load_firmware_settings(printer.file))
    result = solved(content)
    assert not result.is_contradicted
    assert "touches within 0.02 mm, distances within 0.05 mm" in notes[-1]
    # The error of all twelve numbers, measured by what is told of them: about as many squares.
    error = result.machine.vector - printer.true.vector
    assert error @ np.linalg.solve(result.covariance, error) < 30.0
    # Heights are better by far than with the settings.
    now, before = [], []
    for x, y in [(0.0, 0.0), *ring(70.0, 8)]:
        heights = np.array(TriGlide(printer.true.geometry).inverse((x / MM, y / MM, 0.0)))
        reported = heights - printer.true.height_offsets
        before.append(MM * printer.believed.forward(reported)[2])
        believed = TriGlide(result.machine.geometry)
        now.append(MM * believed.forward(reported + np.array(result.machine.height_offsets))[2])
    assert np.abs(now).max() < 0.05 < 0.5 < np.abs(before).max()


KLIPPER, G33, G32, MAP = "klipper", "marlin G33", "reprap G32", "reprap map"
CALIBRATED = "Calibrated 6 factors using 16 points, (mean, deviation) before (0.1, 0.2)"


@pytest.mark.parametrize(
    ("kind", "pattern", "after", "words"),
    [
        (KLIPPER, "distance0_pos1 =", "distance0_pos =", "has distance0 and distance0_pos and"),
        (KLIPPER, "distance1 =", "distance7 =", "has distance7: there must be distance7 and"),
        (KLIPPER, "height3 =", "height3_pos1 =", "has height3_pos1 and height3_pos: there must be"),
        (KLIPPER, "manual_height0 = 0.0", "manual_height0 = high", "manual_height0 is 'high'"),
        (KLIPPER, "height1_pos = ", "height1_pos = 1,", "height1_pos is '1,"),
        (KLIPPER, "height1_pos = ", "height1_pos = 1e999 ;", "must be 3 numbers"),
        (KLIPPER, "distance2 = ", "distance2 = -", "measured distance = -0.1"),
        (G33, "P3", "P5", "with P5, heights are means of several places"),
        (G33, " P3", "", "with P4, heights are means"),
        (G33, "P3", "P0", "with P0, heights are means of several places, or"),
        (G33, "Send: G33", "Send: M33", "the command is not there"),
        (G33, "V0", "V0 O", "with O, the probe is beside the circle"),
        (G33, "[cxyz]:", "", "no heights are printed: run G33 P3 V0"),
        (G33, "Radius:104.20", "Radius:103.00", "line 4: Radius was 103.00, and is 104.2 in the"),
        (G33, "Ey:-0.30", "Ey:-0.50", "Ey was -0.50, and is -0.3"),
        (G33, "(?s).+", "FIRMWARE_NAME:Marlin", "log0.txt: has nothing that marlin measured"),
        (G32, "(?s).+", CALIBRATED, "line 1: this calibration prints no heights: write S-1"),
        (G32, r" 0\.", " zero.", "height of P"),
        (MAP, ",9,9", ",9,8.5", "must have 8.5"),
        (MAP, ",9,9", ",8,9", "line 4: has 9 heights, must"),
        (MAP, r"(?s)\A(.{700}).*", r"\1", "heights"),
        (MAP, r"(?s)xmin(.*)\n-80.0", r"axis0,axis1,xmin\1\nX,Z,-80.0", "line 3: is no map over X"),
        (MAP, "spacing", "space", "xspacing,spacing0,spacing is 'missing', must be a number"),
        (MAP, "-80.00", "-800", "line "),
        (MAP, r"(?s)\n.*", "", "log0.txt: line 1: xmin,min0 is 'missing'"),
    ],
)
def test_a_log_that_lacks_something_is_refused_in_a_line_that_names_it(
    tmp_path, kind, pattern, after, words
):
    printer, logs = log_of(tmp_path, kind, 3)
    text = logs[0].read_text()
    logs[0].write_text(re.sub(pattern, after, text))
    assert logs[0].read_text() != text
    with pytest.raises(KinematicsError) as caught:
        load_log(logs[:1] if kind == G33 else logs, printer.settings)
    said = str(caught.value).removeprefix(f"{tmp_path}/")
    assert words in said
    assert "\n" not in said
    assert kind != KLIPPER or said.startswith("printer.cfg: line ")


def test_klipper_counts_steps_that_the_settings_must_tell(tmp_path):
    printer, files = log_of(tmp_path, "klipper", 3)
    printer.file.write_text(printer.file.read_text().replace("microsteps: 16\n[pri", "[pri"))
    with pytest.raises(
        FirmwareError, match=r"the settings of stepper_c tell none by its rotation_distance"
    ):
        load_log(files, load_firmware_settings(printer.file))


def test_without_a_radius_configuration_h_is_asked_for(tmp_path):
    printer, files = log_of(tmp_path, "marlin G33", 3)
    printer.file.write_text(CONFIGURATION.replace("  #define DELTA_PRINTABLE_RADIUS 90.0\n", ""))
    settings = load_firmware_settings(printer.file)
    with pytest.raises(FirmwareError, match=r"prints no radius.*name Configuration\.h"):
        load_log(files[:1], settings)
    # Newer ones print it.
    files[0].write_text(printer.g33("G33 P2 V0", 72.0, printed=True))
    assert len(load_log(files[:1], settings)[0].touches) == 4


def test_what_is_measured_with_other_settings_is_left_out(tmp_path):
    printer, files = log_of(tmp_path, "marlin G30", 3)
    text = printer.g33("G33 P3 V3", 80.0).replace(" (DRY-RUN)", "")
    text = text.replace("End DRY-RUN", "Iteration : 01") + files[0].read_text()
    files[0].write_text(text)
    content, notes = load_log(files, printer.settings)
    assert len(content.touches) == 7
    assert "log0.txt: line 8: settings are changed here" in notes[0]


def test_a_point_that_could_not_be_probed_is_told(tmp_path):
    printer, files = log_of(tmp_path, "reprap G32", 3)
    words = files[0].read_text().split(" ")
    words[5] = "probing failed"
    files[0].write_text(" ".join(words))
    content, notes = load_log(files, printer.settings)
    assert len(content.touches) == 15
    assert "log0.txt: line 2: P1: probing failed" in notes[0]


def test_a_log_in_latin_1_with_a_mark_or_with_cr_alone_is_the_same(tmp_path):
    printer, files = log_of(tmp_path, "reprap G32", 3)
    expected = load_log(files, printer.settings)[0]
    text = "; geprüft\n" + files[0].read_text()
    for content in (
        text.encode("latin-1"),
        text.encode("utf-8-sig"),
        text.replace("\n", "\r").encode(),
    ):
        files[0].write_bytes(content)
        assert load_log(files, printer.settings)[0] == expected


def test_a_height_that_contradicts_all_others_is_named(tmp_path):
    printer, files = log_of(tmp_path, "reprap map", 3)
    lines = files[0].read_text().split("\n")
    cells = lines[6].split(",")
    cells[3] = f"{float(cells[3]) + 0.8:7.3f}"
    lines[6] = ",".join(cells)
    files[0].write_text("\n".join(lines))
    result = solved(load_log(files, printer.settings)[0])
    assert len(result.outliers) == 1
    assert not result.is_contradicted


def test_heights_of_other_settings_contradict_each_other(tmp_path):
    printer, files = log_of(tmp_path, "reprap map", 3)
    rng = np.random.default_rng(1)
    text = files[0].read_text().split("\n")
    rows = [
        ",".join(
            c if c.strip() == "0" else f"{float(c) + rng.normal(0, 0.4):.3f}"
            for c in row.split(",")
        )
        for row in text[3:-1]
    ]
    files[0].write_text("\n".join([*text[:3], *rows, ""]))
    assert solved(load_log(files, printer.settings)[0]).is_contradicted


def test_a_distance_between_other_places_is_named(tmp_path):
    printer, files = log_of(tmp_path, "klipper", 3)
    whole = files[0].read_text()
    fields = ("distance1_pos1", "distance2_pos1")
    swapped = whole.replace(fields[0], "swap").replace(fields[1], fields[0])
    files[0].write_text(swapped.replace("swap", fields[1]))
    content, notes = load_log(files, printer.settings)
    assert "touch 1 and distance 1 are height0 and distance0" in notes[0]
    with pytest.raises(NoMachineThereError, match="distance 2 does not fit the nominal machine"):
        solved(content)
    # One that was measured at another ridge is left out and named.
    longer = re.sub(r"(?<=distance1 = )\S+", lambda told: f"{float(told[0]) + 0.7}", whole)
    files[0].write_text(longer)
    assert solved(load_log(files, printer.settings)[0]).outliers == ("distance 2",)


def test_the_settings_that_are_found_are_lines_of_the_firmware(tmp_path):
    printer, files = log_of(tmp_path, "klipper", 3)
    result = solved(load_log(files, printer.settings)[0])
    found = towers_of(result.machine, printer.settings.end_stops)
    geometry, ends = found.towers.machine()
    back = MachineParameters(geometry, np.subtract(ends, printer.settings.end_stops))
    for x, y in ring(70.0, 6):
        heights = np.array(printer.believed.inverse((x / MM, y / MM, 0.0)))
        places = [
            TriGlide(each.geometry).forward(heights + np.array(each.height_offsets))
            for each in (result.machine, back)
        ]
        assert places[1] == pytest.approx(np.add(places[0], (*found.shift, 0.0)), abs=1e-9)


@pytest.mark.slow
def test_damaged_logs_are_logs_or_one_line(tmp_path):
    kinds = ("klipper", "marlin G30", "marlin G33", "reprap map", "reprap G32")
    printers = []
    for kind in kinds:
        folder = tmp_path / kind
        folder.mkdir()
        printers.append(log_of(folder, kind, 3))
    for k in range(many(200)):
        printer, files = printers[k % len(kinds)]
        rng = np.random.default_rng((seed(9), k))
        whole = files[0].read_bytes()
        files[0].write_bytes(mutated(whole, rng))
        try:
            found = load_log(files, printer.settings)[0]
        except KinematicsError as error:
            assert str(error).startswith(f"{files[0].parent}/")
            assert "\n" not in str(error)
        else:
            assert found.touches or found.distances
        finally:
            files[0].write_bytes(whole)
