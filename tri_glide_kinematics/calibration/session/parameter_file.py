"""Writes the parameter file that makes the nodes use a calibration."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tri_glide_kinematics.calibration.fit import MachineParameters
from tri_glide_kinematics.calibration.session.errors import SavingError
from tri_glide_kinematics.files import replace_file

# One section for all nodes, as in config/tri_glide.yaml: so "-p name:=value" wins over it.
TEXT = """# Geometry of one machine, as it was calibrated. All nodes take it after their other file:
# --params-file tri_glide.yaml --params-file {name}
# In braces, so that a file that is cut off is refused.
/**: {{ros__parameters: {{
  geometry: calibrated,
  anchors: {anchors}, # m
  arm_lengths: {arm_lengths}, # m
  height_offsets: {height_offsets} # m
}}}}
"""


def parameter_text(machine: MachineParameters, name: str) -> str:
    """Return the text of the file ``name`` for a ``machine``, with lengths to a nanometre."""
    geometry = machine.geometry
    return TEXT.format(
        name=name,
        anchors=_as_yaml(number for anchor in geometry.anchors for number in anchor),
        arm_lengths=_as_yaml(geometry.arm_lengths),
        height_offsets=_as_yaml(machine.height_offsets),
    )


def save_parameters(file: Path, machine: MachineParameters) -> None:
    """Write the file; an older one becomes ``NAME.bak``.

    Raises:
        SavingError: if that is not possible, or a file is there that was not written so.
    """
    try:
        replace_file(file, parameter_text(machine, file.name))
    except OSError as error:
        raise SavingError(f"{file} cannot be written: {error.strerror or error}") from error


def _as_yaml(numbers: Iterable[float]) -> str:
    # Adding zero makes a zero of a negative one.
    return "[" + ", ".join(f"{round(number, 9) + 0.0:.9f}" for number in numbers) + "]"
