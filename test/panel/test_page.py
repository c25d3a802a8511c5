"""The page's server: whom it lets in, and what it refuses."""

import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import msgspec
import pytest
import viser
from viser._messages import RunJavascriptMessage
from viser.infra import _infra
from websockets.asyncio import server
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from testing.page_attack import message as packed
from testing.page_reader import CAMERA, messages_in
from testing.waiting import wait_until
from tri_glide_kinematics.panel.admission import UnguardedPageError, message_of
from tri_glide_kinematics.panel.page import Page, PortTakenError

PROTOCOL = f"viser-v{viser.__version__}"
TOKEN = "Ab_" * 14
Capture = pytest.CaptureFixture[str]
TIMEOUT = 20.0  # s
# {"type": "ShareUrlRequest"} in MessagePack.
SHARE_REQUEST = b"\x81\xa4type\xafShareUrlRequest"


@pytest.fixture
def log() -> list[str]:
    return []


@pytest.fixture
def page(log: list[str]) -> Iterator[Page]:
    page = Page("127.0.0.1", 0, TOKEN, log.append)
    yield page
    page.server.stop()


def connected(page: Page, origin: str | None = None, protocol: str = PROTOCOL) -> ClientConnection:
    address = page.address.replace("http", "ws", 1)
    return connect(address, origin=origin and Origin(origin), subprotocols=[Subprotocol(protocol)])


def _heard(socket: ClientConnection) -> list[dict[str, Any]]:
    return messages_in(socket.recv(TIMEOUT))


def test_a_request_to_share_is_refused(page: Page, log: list[str]) -> None:
    with connected(page, page.origin) as socket:
        socket.send(SHARE_REQUEST)
        wait_until(lambda: log)
    assert "refused to share" in log[0]
    assert page.server._share_tunnel is None
    assert page.server.request_share_url() is None
    assert page.server._share_tunnel is None


def test_the_page_itself_is_let_in_and_others_are_not(page: Page, log: list[str]) -> None:
    with connected(page, page.origin) as socket:
        assert socket.recv(TIMEOUT)
    assert not log
    with pytest.raises(InvalidStatus) as error:
        connected(page, "http://elsewhere.example")
    assert error.value.response.status_code == 403
    assert "the page 'http://elsewhere.example', which is not ours" in log[0]


def test_the_address_becomes_one_without_the_token_that_a_cookie_opens(page: Page) -> None:
    with urlopen(page.address, timeout=TIMEOUT) as entrance:
        assert b'content="0; url=./"' in entrance.read()
        assert entrance.headers["Referrer-Policy"] == "no-referrer"
        assert entrance.headers["Cache-Control"] == "no-store"
        cookie = entrance.headers["Set-Cookie"]
    kept, *attributes = cookie.split("; ")
    assert kept == f"tri_glide_panel_{page.server.get_port()}={TOKEN}"
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(attributes)
    with urlopen(Request(page.origin, headers={"Cookie": kept}), timeout=TIMEOUT) as answer:
        assert b"<title>Viser" in answer.read()
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert answer.headers["X-Frame-Options"] == "DENY"
        policy = answer.headers["Content-Security-Policy"]
        assert f"connect-src ws://127.0.0.1:{page.server.get_port()} " in policy
        assert "frame-ancestors 'none'" in policy


@pytest.mark.parametrize("to_all", [False, True])
def test_what_is_sent_while_a_page_falls_asleep_arrives(page: Page, to_all: bool) -> None:
    websocks = page.server._websock_server
    with connected(page, page.origin) as socket:
        wait_until(lambda: websocks._client_state_from_id)
        (state,) = websocks._client_state_from_id.values()
        buffer = websocks._broadcast_buffer if to_all else state.message_buffer
        event = buffer.message_event
        wait_until(lambda: event._waiters)
        enlist, is_forced = event._get_loop, threading.Event()

        def send(word: str) -> None:
            buffer.push(RunJavascriptMessage(word))

        # asyncio.Event.wait() asks for its loop between its look at the event and its wait for it.
        def between() -> Any:
            event._get_loop = enlist  # type: ignore[method-assign]
            sender = threading.Thread(target=send, args=("while it falls asleep",))
            sender.start()
            sender.join()
            is_forced.set()
            return enlist()

        event._get_loop = between  # type: ignore[method-assign]
        send("to wake it")
        assert is_forced.wait(TIMEOUT)
        told: list[str] = []
        while "while it falls asleep" not in told:
            told += [each.get("source", "") for each in _heard(socket)]


@pytest.mark.parametrize("query", ["", "?token=", f"?token={'x' * 43}", f"?Token={TOKEN}"])
def test_without_the_token_there_is_a_sentence_that_tells_what_to_do(
    page: Page, query: str
) -> None:
    with pytest.raises(HTTPError) as error:
        urlopen(f"{page.origin}/{query}", timeout=TIMEOUT)
    with error.value as answer:
        assert answer.code == 403
        assert "open the address with ?token=" in answer.read().decode()
        assert "Set-Cookie" not in answer.headers


FAULTS: dict[str | bytes, str] = {
    "a text": "it is a text",
    b"": "it cannot be read",
    b"\xc1" * 100: "it cannot be read",
    SHARE_REQUEST: "refused to share",
    packed("RunJavascriptMessage", source="alert(1)"): "it is a RunJavascriptMessage",
    packed("GuiUpdateMessage", uuid="x", updates={"update_cb": []}): "more than the value",
    packed("TransformControlsDragEndMessage"): "it cannot be read",
    packed("TransformControlsUpdateMessage", name="x", wxyz=[1], position=[]): "cannot be read",
}


@pytest.mark.parametrize(("message", "fault"), FAULTS.items(), ids=map(str, range(len(FAULTS))))
def test_what_no_page_says(message: str | bytes, fault: str) -> None:
    assert fault in str(message_of(message))


def test_what_is_dropped_is_counted_in_a_line_a_second(page: Page, log: list[str]) -> None:
    with connected(page, page.origin) as socket:
        for _ in range(125):
            for message in FAULTS:
                socket.send(message)
        # What a page may say is heard after it.
        socket.send(msgspec.msgpack.encode(CAMERA))
        wait_until(page.server.get_clients)
        wait_until(lambda: len(log) > 1)
    assert all(len(line) < 200 and "\n" not in line for line in log)
    assert len(log) < 10
    counts = [int(line.split()[0]) for line in log if "more in the last second" in line]
    assert sum(counts) + len(log) - len(counts) == 1000


def test_a_file_is_for_the_panel_and_not_for_viser(page: Page, log: list[str]) -> None:
    taken: list[tuple[int, object]] = []
    page.on_file = lambda *told: taken.append(told)
    part = {"source_component_uuid": "", "transfer_uuid": "k", "part_index": 0, "content": b"M2"}
    with connected(page, page.origin) as socket:
        socket.send(msgspec.msgpack.encode(CAMERA))
        wait_until(page.server.get_clients)
        socket.send(packed("FileTransferPart", **part))
        wait_until(lambda: taken)
        (number,) = page.server.get_clients()
        assert [told[0] for told in taken] == [number]
        # What a page has sent cannot become a script.
        page.ask_for_pieces(number, '"); alert("', 3)
        asked = 'sendPieces("\\"); alert(\\"", 3)'
        while not any(asked in each.get("source", "") for each in _heard(socket)):
            pass
    assert not page.server.gui._current_file_upload_states
    assert not log


def test_a_message_of_a_megabyte_ends_its_connection(page: Page) -> None:
    with connected(page, page.origin) as socket:
        socket.send(bytes(1_000_000))
        with pytest.raises(ConnectionClosed):
            while True:
                socket.recv(TIMEOUT)
    assert socket.protocol.close_code == 1009


def test_a_page_of_another_viser_is_told(page: Page, log: list[str], capfd: Capture) -> None:
    with connected(page, page.origin, "viser-v0.0.1") as socket:
        with pytest.raises(ConnectionClosed):
            socket.recv(TIMEOUT)
    assert socket.protocol.close_reason.startswith("Version mismatch. Client: 0.0.1, Server")
    wait_until(lambda: log)
    assert "another viser" in log[0]
    assert capfd.readouterr() == ("", "")


def test_a_viser_that_serves_in_another_way_is_not_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given = server.serve
    monkeypatch.setattr(_infra, "websockets", SimpleNamespace(**vars(_infra.websockets)))
    asyncio_ = SimpleNamespace(server=SimpleNamespace(**{**vars(server), "serve": given}))
    monkeypatch.setattr(_infra.websockets, "asyncio", asyncio_)
    stopped = []
    monkeypatch.setattr(viser.ViserServer, "stop", lambda self: stopped.append(self))
    with pytest.raises(UnguardedPageError, match="does not let this panel refuse connections"):
        Page("127.0.0.1", 0, TOKEN, print)
    monkeypatch.undo()
    (left,) = stopped
    left.stop()


def test_a_port_that_is_taken_is_told(page: Page) -> None:
    port = page.server.get_port()
    with pytest.raises(PortTakenError, match=f"port {port} of 127.0.0.1 is in use"):
        Page("127.0.0.1", port, TOKEN, print)
