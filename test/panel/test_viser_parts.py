"""Another version of viser that lacks what the panel takes from inside it is found out here.

What ``page.js`` takes of viser's page is looked at in a browser, in ``integration/test_panel.py``.
"""

import inspect
from dataclasses import fields

import pytest

viser = pytest.importorskip("viser")
from viser.infra import _infra  # noqa: E402

from tri_glide_kinematics.panel.viser_parts import messages, show_value  # noqa: E402

# What each message is made of, as the panel and ``page.js`` write and read it.
MESSAGES = {
    "FileTransferPart": "source_component_uuid transfer_uuid part_index content",
    "FileTransferStartUpload": "source_component_uuid transfer_uuid filename mime_type part_count "
    "size_bytes",
    "GuiButtonHoldMessage": "uuid frequency",
    "GuiUpdateMessage": "uuid updates",
    "RunJavascriptMessage": "source",
    "SetOrientationMessage": "name wxyz",
    "SetPositionMessage": "name position",
    "ShareUrlDisconnect": "",
    "ShareUrlRequest": "",
    "TransformControlsDragEndMessage": "name",
    "TransformControlsDragStartMessage": "name",
    "TransformControlsUpdateMessage": "name wxyz position",
    "ViewerCameraMessage": "",
}


def lacks(what: str) -> str:
    return f"viser {viser.__version__} has another {what}: see panel/viser_parts.py"


@pytest.mark.parametrize("name", MESSAGES)
def test_messages(name: str) -> None:
    message = getattr(messages, name, None)
    assert message is not None, lacks(name)
    has = [each.name for each in fields(message)]
    assert set(MESSAGES[name].split()) <= set(has), lacks(name)
    # These are made without names.
    if name in ("RunJavascriptMessage", "SetOrientationMessage", "SetPositionMessage"):
        assert MESSAGES[name].split() == has[: len(MESSAGES[name].split())], lacks(name)


def test_connections(server: viser.ViserServer) -> None:
    parameters = list(inspect.signature(messages.Message.deserialize).parameters)
    assert len(parameters) == 1, lacks("Message.deserialize")
    inner = getattr(server, "_websock_server", None)
    assert isinstance(getattr(inner, "_client_connect_cb", None), list), lacks("_client_connect_cb")
    for name in ("_live_connections", "_client_state_from_id"):
        assert isinstance(getattr(inner, name, None), dict), lacks(name)
    event = getattr(getattr(inner, "_broadcast_buffer", None), "message_event", None)
    assert hasattr(event, "set") and hasattr(event, "clear"), lacks("_broadcast_buffer")
    assert "message_buffer" in inspect.getsource(_infra), lacks("message_buffer")
    source = inspect.getsource(viser.ClientHandle)
    assert "self._websock_connection" in source, lacks("_websock_connection")
    assert hasattr(_infra.WebsockClientConnection, "queue_message"), lacks("queue_message")
    assert callable(server.request_share_url), lacks("request_share_url")


def test_handles(server: viser.ViserServer) -> None:
    uuid = getattr(getattr(server.gui.add_text("a", ""), "_impl", None), "uuid", None)
    assert isinstance(uuid, str), lacks("handle of fields")
    inner = getattr(server.scene.add_frame("/a"), "_impl", None)
    for name, shape in (("position", (3,)), ("wxyz", (4,))):
        assert getattr(getattr(inner, name, None), "shape", None) == shape, lacks(name)
    queue = getattr(getattr(inner, "api", None), "_queue_scene_message", None)
    assert queue is not None, lacks("_queue_scene_message")
    assert len(inspect.signature(queue).parameters) == 1, lacks("_queue_scene_message")


def test_a_value_is_sent_that_the_panel_has_already(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    slider, sent = server.gui.add_slider("a", 1, 100, 1, 70), []
    monkeypatch.setattr(slider._impl.gui_api._websock_interface, "queue_message", sent.append)
    show_value(slider, 70)
    assert [each.updates for each in sent] == [{"value": 70}]
