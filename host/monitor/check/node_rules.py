"""Rules about nodes: that they are there, and stay up.

A node was heard by whatever it sent on one of its default COB-IDs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tickrig.host.monitor.check.frame_rules import FrameRule
from tickrig.host.monitor.check.rule import Suspects
from tickrig.host.monitor.check.time_rules import BOOT_UP
from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.frames.node_of import sender_of
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import ALL_NODES, ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand

RESETS: Final = frozenset([NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION])
ERROR_CONTROL_IDS: Final = range(ERROR_CONTROL_COB_ID + 1, ERROR_CONTROL_COB_ID + 0x80)


class NodesPresent(FrameRule):
    """These nodes are heard."""

    name = "nodes"

    def __init__(self, nodes: Iterable[int]) -> None:
        self._nodes = sorted(nodes)

    def wants(self, ident: int, /) -> bool:
        """Take nothing: what is missing is seen at the end."""
        return False

    def judge(self, heard: Heard, gap_us: int | None, /) -> str | None:
        """Find nothing."""
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Name those that were never heard."""
        heard = set(map(sender_of, latest_us))
        for node in self._nodes:
            if node not in heard:
                yield f"node {node} was never heard"


class NoReboot(FrameRule):
    """No node that was heard before boots without an NMT reset."""

    name = "no-reboot"

    def __init__(self) -> None:
        self._asked: set[int] = set()
        self._heard: set[tuple[str, int]] = set()

    def wants(self, ident: int, /) -> bool:
        """Take NMT commands and what nodes send."""
        return ident == NMT_COB_ID or sender_of(ident) is not None

    def suspects(self, ident: int, /) -> Suspects:
        """Suspect resets and boot-ups; the first frame of anything else tells of its node."""
        if ident == NMT_COB_ID:
            return Suspects(first_bytes=RESETS)
        boot_up = frozenset(BOOT_UP) if ident in ERROR_CONTROL_IDS else frozenset()
        return Suspects(first_bytes=boot_up, firsts=True)

    def judge(self, heard: Heard, gap_us: int | None, /) -> str | None:
        """Note a reset; say that a boot-up comes without one."""
        frame = heard.frame
        assert isinstance(frame, CanFrame)
        node = sender_of(frame.can_id)
        if node is None:
            if len(frame.data) == 2 and frame.data[0] in RESETS:
                self._ask(frame.data[1])
            return None
        is_new = (heard.channel, node) not in self._heard
        self._heard.add((heard.channel, node))
        if frame.can_id not in ERROR_CONTROL_IDS or frame.data != BOOT_UP:
            return None
        expected = is_new or node in self._asked
        self._asked.discard(node)
        return None if expected else f"node {node} boots again without an NMT reset"

    def _ask(self, node: int) -> None:
        self._asked |= set(range(1, 0x80)) if node == ALL_NODES else {node}
