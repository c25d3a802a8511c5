"""What the panel knows of a machine bounds its programs as ``ik_node`` does."""

from __future__ import annotations

import pickle

from tri_glide_kinematics.control import TEACH_SPEED
from tri_glide_kinematics.motion import ForceLimits, PlatformSpeedLimit
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.settings import IK_NODE

FACTS = MachineFacts({parameter.name: parameter.default for parameter in IK_NODE})
MASSES = {"carriage_masses": (2.0,) * 3, "platform_mass": 1.0, "force_limit_up": (60.0,) * 3}


def test_the_proof_of_a_program_counts_what_bounds_all_motion() -> None:
    assert FACTS.bounds.limits.added == ()
    bounded = FACTS.with_changes({**MASSES, "platform_speed_limit": 0.4})
    speed, forces = bounded.bounds.limits.added
    assert speed == PlatformSpeedLimit(FACTS.machine, 0.4)
    assert isinstance(forces, ForceLimits) and forces.up == (60.0,) * 3
    taught = bounded.with_teach_mode(True).bounds.limits
    assert taught.added == (PlatformSpeedLimit(FACTS.machine, TEACH_SPEED), forces)
    slower = bounded.with_teach_mode(True).with_changes({"platform_speed_limit": 0.1})
    assert slower.bounds.limits.platform_speed == 0.1
    assert slower.with_teach_mode(False).is_same_machine(FACTS)


def test_what_bounds_no_motion_leaves_the_proof_of_a_program_valid() -> None:
    bounded = FACTS.with_changes({**MASSES, "platform_speed_limit": 0.4})
    assert bounded.with_changes({"twist_timeout": 0.2}).bounds == bounded.bounds
    assert bounded.with_changes({"payload": 0.2}).bounds != bounded.bounds
    assert bounded.with_teach_mode(True).bounds != bounded.bounds
    # It goes to the process that proves.
    assert pickle.loads(pickle.dumps(bounded.bounds)) == bounded.bounds
