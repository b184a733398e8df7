"""Reads and writes objects of a node by SDO, and hears the values of all nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import Entry
from tickrig.host.canmon.model.decode.sdo.transfer import write_entry
from tickrig.host.canmon.model.dictionary.node_dictionary import NodeDictionary
from tickrig.host.canmon.tui.tasks.session import DecodedFrame, Task
from tickrig.host.canopen.dialogue import Dialogue, Failure, QueuedScript, Script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.sdo.sdo_command import RESPONSE_COB_ID
from tickrig.wire.instant import NEVER

Node = tuple[str, int]
"""Bus and node-ID."""

NOW: Final = 0
"""When frames are due that have not been sent yet."""

WATCH_US: Final = 1_000_000
"""How often watched objects are read."""


class DictionaryTask(Task):
    """A client of the default SDO of one node at a time (1200h).

    What is shown comes from the traffic alone: answers are heard as those to others are.

    Args:
        decoder: knows the nodes.

    Attributes:
        channel: the bus it sends on; empty for the first.
        result: how the latest transfer ended, in words.
        left: transfers that have not ended.
        watched: objects that are read again and again.
    """

    def __init__(self, decoder: Decoder) -> None:
        self.channel, self.result, self.left = "", "", 0
        self._decoder = decoder
        self._nodes: dict[Node, NodeDictionary] = {}
        self._out: list[CanFrame] = []
        self._node: Node | None = None
        self._dialogue = Dialogue(1, self._send)
        self._dialogues: dict[Node, Dialogue] = {}
        self.watched: set[Entry] = set()
        self._watch_us = NEVER

    @property
    def due_us(self) -> int:
        """When it next wants to be called without a frame."""
        return NOW if self._out else min(self._dialogue.due_us, self._watch_us)

    def objects(self, node: Node) -> NodeDictionary:
        """Return the objects of a node."""
        found = self._nodes.get(node)
        if found is None:
            found = self._nodes[node] = NodeDictionary(self._decoder.memory(*node))
        return found

    def choose(self, node: Node) -> None:
        """Talk to a node from now on; transfers with another one are given up."""
        if node != self._node:
            self.stop()
            self._node, self.channel = node, node[0]
            if node not in self._dialogues:
                self._dialogues[node] = Dialogue(node[1], self._send)
            self._dialogue = self._dialogues[node]

    def read(self, now_us: int, entry: Entry) -> None:
        """Read an object of the chosen node."""
        self._start(now_us, f"read {write_entry(entry)}", upload(*entry))

    def write(self, now_us: int, entry: Entry, data: bytes) -> None:
        """Write an object of the chosen node."""
        self._start(now_us, f"write {write_entry(entry)}", download(*entry, data))

    def watch(self, now_us: int, entry: Entry) -> None:
        """Read an object of the chosen node each second, or no more if it is watched."""
        self.watched ^= {entry}
        self._watch_us = now_us if self.watched else NEVER

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Take values and answers; return requests."""
        for one, decoded in records:
            if decoded.node is None:
                continue
            node = one.channel, decoded.node
            if decoded.transfers or decoded.kind[1:4] == "pdo":
                self.objects(node).take(one.at_us, decoded)
            if node == self._node and decoded.kind == "sdo" and isinstance(one.frame, CanFrame):
                self._receive(now_us, one.frame)
        self._dialogue.tick(now_us)
        if now_us >= self._watch_us:
            self._read_watched(now_us)
        out, self._out = tuple(self._out), []
        return out

    def stop(self) -> None:
        """Give up all transfers; nothing is watched."""
        self.watched.clear()
        self._watch_us = NEVER
        self._dialogue.clear()
        self._out.clear()
        self.left = 0

    def _read_watched(self, now_us: int) -> None:
        """Read what is watched, unless earlier transfers go on."""
        self._watch_us += (now_us - self._watch_us) // WATCH_US * WATCH_US + WATCH_US
        if not self.left:
            for entry in sorted(self.watched):
                self.read(now_us, entry)

    def _receive(self, now_us: int, frame: CanFrame) -> None:
        if self._node and frame.can_id == RESPONSE_COB_ID + self._node[1] and not frame.remote:
            self._dialogue.receive_sdo(now_us, frame.data)

    def _send(self, can_id: int, data: bytes) -> None:
        self._out.append(CanFrame(can_id, data))

    def _start(self, now_us: int, what: str, script: Script[object]) -> None:
        def done(result: object) -> None:
            self._ended(f"{what}: done")

        def failed(failure: Failure) -> None:
            self._ended(str(failure))

        self.left += 1
        self._dialogue.start(now_us, QueuedScript(what, script, done, failed))

    def _ended(self, said: str) -> None:
        self.left -= 1
        self.result = said
