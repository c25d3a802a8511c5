"""Firmwares of printers: their settings are read and written as those of this machine."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.firmwares.logs import check_no_log as check_no_log
    from tri_glide_kinematics.firmwares.logs import firmware_lines as firmware_lines
    from tri_glide_kinematics.firmwares.logs import load_log as load_log
    from tri_glide_kinematics.firmwares.parameters import firmware_text as firmware_text
    from tri_glide_kinematics.firmwares.parameters import load_parameters as load_parameters
    from tri_glide_kinematics.firmwares.parameters import parameter_text as parameter_text
    from tri_glide_kinematics.firmwares.parameters import parameters_of as parameters_of
    from tri_glide_kinematics.firmwares.parameters import (
        program_settings_text as program_settings_text,
    )
    from tri_glide_kinematics.firmwares.reading import Firmware as Firmware
    from tri_glide_kinematics.firmwares.reading import FirmwareError as FirmwareError
    from tri_glide_kinematics.firmwares.reading import FirmwareLimits as FirmwareLimits
    from tri_glide_kinematics.firmwares.reading import FirmwareSettings as FirmwareSettings
    from tri_glide_kinematics.firmwares.reading import Said as Said
    from tri_glide_kinematics.firmwares.reading import (
        load_firmware_settings as load_firmware_settings,
    )

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
