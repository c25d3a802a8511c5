"""What the page and the machine tell each other: requests of operators, and answers."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.machine.link import LARGEST_LAG as LARGEST_LAG
    from tri_glide_kinematics.panel.machine.link import NAMES as NAMES
    from tri_glide_kinematics.panel.machine.link import NOBODY as NOBODY
    from tri_glide_kinematics.panel.machine.link import TABLE as TABLE
    from tri_glide_kinematics.panel.machine.link import Bounds as Bounds
    from tri_glide_kinematics.panel.machine.link import Feeds as Feeds
    from tri_glide_kinematics.panel.machine.link import Identity as Identity
    from tri_glide_kinematics.panel.machine.link import MachineFacts as MachineFacts
    from tri_glide_kinematics.panel.machine.link import MachineLink as MachineLink
    from tri_glide_kinematics.panel.machine.link import MotionFeed as MotionFeed
    from tri_glide_kinematics.panel.machine.link import NewestWish as NewestWish
    from tri_glide_kinematics.panel.machine.link import SteadyTimes as SteadyTimes
    from tri_glide_kinematics.panel.machine.link import SwingFeed as SwingFeed
    from tri_glide_kinematics.panel.machine.operator_requests import RENEWALS as RENEWALS
    from tri_glide_kinematics.panel.machine.operator_requests import SLOWEST_SPEED as SLOWEST_SPEED
    from tri_glide_kinematics.panel.machine.operator_requests import USUAL_SPEED as USUAL_SPEED
    from tri_glide_kinematics.panel.machine.operator_requests import Entry as Entry
    from tri_glide_kinematics.panel.machine.operator_requests import Event as Event
    from tri_glide_kinematics.panel.machine.operator_requests import JogWatch as JogWatch
    from tri_glide_kinematics.panel.machine.operator_requests import (
        OperatorRequests as OperatorRequests,
    )
    from tri_glide_kinematics.panel.machine.operator_requests import (
        OperatorsInput as OperatorsInput,
    )
    from tri_glide_kinematics.panel.machine.operator_requests import (
        OperatorsNumber as OperatorsNumber,
    )
    from tri_glide_kinematics.panel.machine.operator_requests import PagesBar as PagesBar
    from tri_glide_kinematics.panel.machine.operator_requests import SpeedFields as SpeedFields
    from tri_glide_kinematics.panel.machine.operator_requests import Steps as Steps
    from tri_glide_kinematics.panel.machine.operator_requests import pages_text as pages_text
    from tri_glide_kinematics.panel.machine.words import FAULT as FAULT
    from tri_glide_kinematics.panel.machine.words import READY as READY
    from tri_glide_kinematics.panel.machine.words import WARNING as WARNING
    from tri_glide_kinematics.panel.machine.words import bar as bar
    from tri_glide_kinematics.panel.machine.words import clock_text as clock_text
    from tri_glide_kinematics.panel.machine.words import code as code
    from tri_glide_kinematics.panel.machine.words import legend as legend
    from tri_glide_kinematics.panel.machine.words import note as note
    from tri_glide_kinematics.panel.machine.words import outside_text as outside_text
    from tri_glide_kinematics.panel.machine.words import position_text as position_text
    from tri_glide_kinematics.panel.machine.words import progress as progress
    from tri_glide_kinematics.panel.machine.words import table as table

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
