"""How nodes and commands start and end."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.starting.processes import LaunchError as LaunchError
    from tri_glide_kinematics.ros.starting.processes import NodeProcesses as NodeProcesses
    from tri_glide_kinematics.ros.starting.processes import Process as Process
    from tri_glide_kinematics.ros.starting.processes import check_launch as check_launch
    from tri_glide_kinematics.ros.starting.processes import (
        default_parameter_file as default_parameter_file,
    )
    from tri_glide_kinematics.ros.starting.processes import ending as ending
    from tri_glide_kinematics.ros.starting.processes import executable as executable
    from tri_glide_kinematics.ros.starting.run import NUMPY_SETTINGS as NUMPY_SETTINGS
    from tri_glide_kinematics.ros.starting.run import EndSignals as EndSignals
    from tri_glide_kinematics.ros.starting.run import FatalError as FatalError
    from tri_glide_kinematics.ros.starting.run import raise_at_signals as raise_at_signals
    from tri_glide_kinematics.ros.starting.run import shut_down as shut_down
    from tri_glide_kinematics.ros.starting.transport import CELL as CELL
    from tri_glide_kinematics.ros.starting.transport import COMPUTER as COMPUTER
    from tri_glide_kinematics.ros.starting.transport import MEANINGS as MEANINGS
    from tri_glide_kinematics.ros.starting.transport import (
        MIDDLEWARE_VARIABLES as MIDDLEWARE_VARIABLES,
    )
    from tri_glide_kinematics.ros.starting.transport import RANGE as RANGE
    from tri_glide_kinematics.ros.starting.transport import VARIABLE as VARIABLE
    from tri_glide_kinematics.ros.starting.transport import choose_transport as choose_transport
    from tri_glide_kinematics.ros.starting.transport import transport_of as transport_of

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
