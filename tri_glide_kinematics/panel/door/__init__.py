"""Admission to the page: hosts, origins and the token."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.door.admission import QUERY as QUERY
    from tri_glide_kinematics.panel.door.admission import Admission as Admission
    from tri_glide_kinematics.panel.door.admission import Request as Request
    from tri_glide_kinematics.panel.door.admission import is_loopback as is_loopback
    from tri_glide_kinematics.panel.door.admission import shown as shown
    from tri_glide_kinematics.panel.door.guard import fault_of as fault_of
    from tri_glide_kinematics.panel.door.guard import guarded_server as guarded_server
    from tri_glide_kinematics.panel.door.token import TOKEN as TOKEN
    from tri_glide_kinematics.panel.door.token import default_token_file as default_token_file
    from tri_glide_kinematics.panel.door.token import kept_token as kept_token

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
