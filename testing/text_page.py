"""A page of the panel without a browser: it knows the texts and controls, and draws nothing."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import suppress
from html import unescape
from threading import Thread
from typing import Any

from websockets.exceptions import ConnectionClosed

from testing import page_reader

# How page.js is told what stands above the page, and what Stop presses.
SHOWN = re.compile(r"window\.triGlide\?\.show\((.*)\)")
SETTINGS = re.compile(r"^const settings = (.*);$", re.MULTILINE)
# A button of the pad, and other ones that page.js presses: what it does, of what, and its name.
PAD = re.compile(r'data-(?:hold|press)="([^"]+)"[^>]*>([^<]*)<')
BUTTON = "GuiButtonMessage"
RENEWALS = 30  # of a button that is held [1/s]


class TextPage:
    """A connection to the panel, as that of a page of which only texts and controls matter.

    Attributes:
        tab: that is open: only what it shows is read and pressed.
        strip: what stands above the page, by its kind: state, reason, refusal, pages.
        nodes: names of all that the scene has.
        downloads: pieces of the files that came, by their names.
    """

    def __init__(self, address: str, tab: str = "Drive") -> None:
        """Open the panel with this ``address``, the token included."""
        self.tab = tab
        self.strip: dict[str, Any] = {}
        self.nodes: set[str] = set()
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
                for message in page_reader.messages_in(data):
                    self._take(message)

    def _take(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        if kind == "RunJavascriptMessage":
            source = message["source"]
            if found := SHOWN.fullmatch(source):
                self.strip = json.loads(found.group(1))
            elif found := SETTINGS.search(source):
                self._settings = json.loads(found.group(1))
        elif kind == "GuiUpdateMessage":
            control = self._controls[message["uuid"]]
            updates = message["updates"]
            if "value" in updates:
                control["value"] = updates["value"]
            control["props"].update(updates)
        elif kind == "FileTransferStartDownload":
            self._transfers[message["transfer_uuid"]] = message["filename"]
            self.downloads[message["filename"]] = []
        elif kind == "FileTransferPart":
            name = self._transfers[message["transfer_uuid"]]
            self.downloads[name].append(bytes(message["content"]))
        elif kind == "RemoveSceneNodeMessage":
            self.nodes.discard(message["name"])
        elif "container_uuid" in message:
            self._controls[message["uuid"]] = message
        elif "props" in message and "name" in message:
            self.nodes.add(message["name"])

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

    def value_of(self, label: str) -> Any:
        """Return what stands in the field with a ``label``."""
        return self._labelled(label)["value"]

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

    def hold(self, words: str) -> None:
        """Say once that the button of the pad with these ``words`` is held."""
        self._send("GuiButtonHoldMessage", uuid=self._pad(words), frequency=RENEWALS)

    def stop(self) -> None:
        """Press Stop."""
        self._press(self._settings["stop"])

    def upload(self, name: str, file: str | bytes) -> None:
        """Send a small ``file``."""
        content = file.encode() if isinstance(file, str) else file
        transfer = {"source_component_uuid": "", "transfer_uuid": name}
        told = {"filename": name, "mime_type": "", "part_count": 1, "size_bytes": len(content)}
        self._send("FileTransferStartUpload", **transfer, **told)
        self._send("FileTransferPart", **transfer, part_index=0, content=content)

    def cut(self) -> None:
        """End the connection without a word, as a browser does that is killed."""
        self._socket.socket.close()

    def _pad(self, words: str) -> str:
        html = "".join(each["props"].get("content", "") for each in self._shown())
        return next(uuid for uuid, name in PAD.findall(html) if name == words)

    def _labelled(self, label: str) -> dict[str, Any]:
        return next(each for each in self._shown() if each["props"].get("label") == label)

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
