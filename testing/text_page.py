"""A page of the panel without a browser: it knows the texts and controls, and draws nothing."""

import json
import re
from collections.abc import Iterator
from contextlib import suppress
from html import unescape
from random import random
from threading import Thread
from typing import Any

from websockets.exceptions import ConnectionClosed

from testing import page_reader

# How page.js is told what stands above the page, and what Stop presses.
SHOWN = re.compile(r"window\.triGlide\?\.show\((.*)\)")
HISTORY = re.compile(r"window\.triGlide\?\.history\((.*)\)")
SETTINGS = re.compile(r"^const settings = (.*);$", re.MULTILINE)
# A button of the pad, and other ones that page.js presses: what it does, of what, and its name.
PAD = re.compile(r'data-(?:hold|press)="([^"]+)"[^>]*>([^<]*)<')
BUTTON = "GuiButtonMessage"
RENEWALS = 30  # of a button that is held [1/s]


class TextPage:
    """A connection to the panel, as that of a page of which only texts and controls matter.

    Only what the open tab shows is read and pressed.

    Attributes:
        strip: what stands above the page, by its kind: state, reason, refusal, pages.
        history: what was told before, the newest first.
        nodes: names of all that the scene has.
        plots: how often curves were sent.
        loads: bytes that came up to each sign of life, since the one before.
        camera: where it stands and where it looks, as the panel has told it last [m].
        downloads: pieces of the files that came, by their names.
    """

    def __init__(self, address: str, tab: str = "Drive") -> None:
        """Open the panel with this ``address``, the token included."""
        self._tab = tab
        self.strip: dict[str, Any] = {}
        self.history: list[dict[str, Any]] = []
        self.nodes: set[str] = set()
        self.plots = 0
        self.loads: list[int] = []
        self._load = 0
        self.camera: dict[str, tuple[float, float, float]] = {}
        self.downloads: dict[str, list[bytes]] = {}
        self._transfers: dict[str, str] = {}
        self._settings: dict[str, Any] = {}
        self._controls: dict[str, dict[str, Any]] = {}
        self._socket = page_reader.connected(address)
        # Whoever reads nothing is taken for gone.
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        with suppress(ConnectionClosed):
            for data in self._socket:
                self._load += len(data)
                for message in page_reader.messages_in(data):
                    self._take(message)

    def _take(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        if kind == "RunJavascriptMessage":
            source = message["source"]
            if found := SHOWN.fullmatch(source):
                if words := found.group(1):
                    self.strip = json.loads(words)
                else:
                    self.loads.append(self._load)
                    self._load = 0
            elif found := HISTORY.fullmatch(source):
                self.history = json.loads(found.group(1))
            elif found := SETTINGS.search(source):
                self._settings = json.loads(found.group(1))
                self._tell_tab()
        elif kind == "GuiUpdateMessage":
            control = self._controls[message["uuid"]]
            updates = message["updates"]
            self.plots += "data" in updates
            if "value" in updates:
                control["value"] = updates["value"]
            control["props"].update(updates)
        elif kind in ("SetCameraPositionMessage", "SetCameraLookAtMessage"):
            name = "look_at" if "look_at" in message else "position"
            self.camera[name] = message[name]
        elif kind == "FileTransferStartDownload":
            self._transfers[message["transfer_uuid"]] = message["filename"]
            self.downloads[message["filename"]] = []
        elif kind == "FileTransferPart":
            name = self._transfers[message["transfer_uuid"]]
            self.downloads[name].append(bytes(message["content"]))
        elif kind == "GuiRemoveMessage":
            self._controls.pop(message["uuid"], None)
        elif kind == "RemoveSceneNodeMessage":
            self.nodes.discard(message["name"])
        elif "container_uuid" in message:
            self._controls[message["uuid"]] = message
        elif "props" in message and "name" in message:
            self.nodes.add(message["name"])

    @property
    def tab(self) -> str:
        """The tab that is open."""
        return self._tab

    @tab.setter
    def tab(self, tab: str) -> None:
        self._tab = tab
        if self._settings:
            self._tell_tab()

    def _tell_tab(self) -> None:
        self._press(self._settings["tab"], f"{random()} {self._tab}")

    @property
    def text(self) -> str:
        """All words that are seen; between two of them is one space."""
        html = [each["props"]["content"] for each in self._shown() if "content" in each["props"]]
        words = unescape(re.sub("<[^>]*>", " ", " ".join(html)))
        return " ".join(f"{words} {' '.join(map(str, self.strip.values()))}".split())

    @property
    def buttons(self) -> list[str]:
        """The words of all single buttons that are seen."""
        return [each["props"]["label"] for each in self._shown() if each["type"] == BUTTON]

    @property
    def kinds(self) -> set[str]:
        """The kinds of all controls, whether they are seen or not."""
        return {each["type"] for each in tuple(self._controls.values())}

    def choices_of(self, label: str) -> list[str]:
        """Return the choices of the list with a ``label``."""
        return list(self._labelled(label)["props"]["options"])

    def value_of(self, label: str) -> Any:
        """Return what stands in the field with a ``label``; None without such a field."""
        shown = (each for each in self._shown() if each["props"].get("label") == label)
        return next((each["value"] for each in shown), None)

    def _labelled(self, label: str) -> dict[str, Any]:
        return next(each for each in self._shown() if each["props"].get("label") == label)

    def set(self, label: str, value: object) -> None:
        """Put a ``value`` into the field with a ``label``."""
        control = self._labelled(label)
        control["value"] = value
        self._press(control["uuid"], value)

    def click(self, words: str) -> None:
        """Click on the button with these ``words``."""
        for control in self._shown():
            if words in control["props"].get("options", ()) and "Group" in control["type"]:
                return self._press(control["uuid"], words)
            if control["type"] == BUTTON and control["props"]["label"] == words:
                return self._press(control["uuid"])
        return self._press(self._pad(words))

    def press_history(self, words: str) -> None:
        """Click on the button beside the newest message with these ``words``."""
        self._press(next(each["press"] for each in self.history if words in each["text"]))

    def type_line(self, line: str) -> None:
        """Type a line into the field for lines, and press Enter."""
        html = "".join(each["props"].get("content", "") for each in self._shown())
        found = re.search('data-line="([^"]+)"', html)
        assert found
        self._press(found[1], line)

    def hold(self, words: str) -> None:
        """Say once that the button of the pad with these ``words`` is held."""
        self._send("GuiButtonHoldMessage", uuid=self._pad(words), frequency=RENEWALS)

    def stop(self) -> None:
        """Press Stop."""
        self._press(self._settings["stop"])

    def upload(self, name: str, file: str | bytes, size: int | None = None) -> None:
        """Send a small ``file``, or the first piece of one that has a ``size`` [bytes]."""
        content = file.encode() if isinstance(file, str) else file
        transfer = {"source_component_uuid": "", "transfer_uuid": name}
        size = len(content) if size is None else size
        told = {"filename": name, "mime_type": "", "part_count": 1, "size_bytes": size}
        self._send("FileTransferStartUpload", **transfer, **told)
        self._send("FileTransferPart", **transfer, part_index=0, content=content)

    def cut(self) -> None:
        """End the connection without a word, as a browser does that is killed."""
        self._socket.socket.close()

    def _pad(self, words: str) -> str:
        html = "".join(each["props"].get("content", "") for each in self._shown())
        return next(uuid for uuid, name in PAD.findall(html) if name == words)

    def _shown(self) -> Iterator[dict[str, Any]]:
        """Return the controls that are seen on the tab that is open."""
        hidden: set[str] = set()
        # Tabs and folders come before what is in them.
        for control in tuple(self._controls.values()):
            props = control["props"]
            if control["container_uuid"] in hidden or not props["visible"]:
                hidden.add(control["uuid"])
                continue
            tabs = zip(props.get("_tab_labels", ()), props.get("_tab_container_ids", ()))
            hidden.update(container for label, container in tabs if label != self.tab)
            yield control

    def _press(self, uuid: str, value: object = True) -> None:
        self._send("GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def _send(self, kind: str, **values: object) -> None:
        self._socket.send(page_reader.message(kind, **values))

    def close(self) -> None:
        """End the connection."""
        self._socket.close()
        self._reader.join()
