"""Files as slicers, CAM programs and people write them, ten for each kind of firmware."""

from dataclasses import replace
from pathlib import Path

import pytest
from motion_machine import LIMITS
from soak import some

from tri_glide_kinematics.programs import (
    Dialect,
    ProgramError,
    check_program,
    load_program,
    load_settings,
    read_program,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

FILES = Path(__file__).parent / "files"
NAMES = sorted(str(file.relative_to(FILES)) for file in FILES.glob("*/*"))
SETTINGS = load_settings(Path(__file__).parents[2] / "config" / "program_settings.yaml")
WORKSPACE = Workspace(TriGlide(DEFAULT_GEOMETRY), WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6))

# What each of those needs that are not read at the first try, as the error says it.
IGNORED = {
    "klipper/print_start.gcode": {"PRINT_START", "PRINT_END"},
    "klipper/start_print.gcode": {"START_PRINT", "END_PRINT"},
    "marlin/level_first.gcode": {"G29"},
    "reprap/macro.gcode": {"M98"},
}
JOG = "grbl/jog_by_hand.nc"
READ = [name for name in NAMES if name != JOG]
# They show no dialect but that of RS274/NGC, of which grbl's is a part.
AS_NIST = {f"grbl/{name}" for name in ("easel.nc", "fusion360.nc", "inkscape.ngc", "jscut.gcode")}
AS_NIST |= {"grbl/vcarve.tap"}


def read(name):
    """Read a file; if it is refused, do what the error says."""
    if name not in IGNORED:
        return load_program(FILES / name, SETTINGS)
    with pytest.raises(ProgramError, match="under ignored") as caught:
        load_program(FILES / name, SETTINGS)
    # All of them at once.
    assert all(each in str(caught.value) for each in IGNORED[name])
    return load_program(FILES / name, replace(SETTINGS, ignored=frozenset(IGNORED[name])))


@pytest.mark.parametrize("name", READ)
def test_it_is_read_in_its_dialect(name):
    program = read(name)
    dialect = Dialect(Path(name).parent.name)
    seen = "nist: nothing " if name in AS_NIST else f"{dialect.value}, as line "
    assert program.guess.startswith(f"read as {seen}")
    if name not in AS_NIST:
        # As if somebody had named the dialect.
        told = replace(SETTINGS, dialect=dialect, ignored=frozenset(IGNORED.get(name, ())))
        assert load_program(FILES / name, told).told == program.told


@pytest.mark.slow
@pytest.mark.parametrize("name", some([*READ[::4], *READ], 6))
def test_it_can_be_driven(name):
    assert check_program(read(name), WORKSPACE, LIMITS).duration > 0.5


def test_a_jog_is_refused_until_it_is_a_line():
    with pytest.raises(ProgramError, match=r"line 3, column 1: .J=G91: .* as lines of G1"):
        load_program(FILES / JOG, SETTINGS)
    text = (FILES / JOG).read_text().replace("$J=G91 X5 F500", "G91 G1 X5 F500")
    assert read_program(text, SETTINGS).guess.startswith("read as grbl")


def test_there_are_ten_of_each_kind():
    kinds = [Path(name).parent.name for name in NAMES]
    assert {kind: kinds.count(kind) for kind in kinds} == dict.fromkeys(
        ("grbl", "klipper", "marlin", "reprap"), 10
    )
