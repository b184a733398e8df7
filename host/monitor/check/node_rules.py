"""Rules about nodes: that they are there, and stay up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tickrig.host.monitor.check.frame_rules import NODE_MASK, FrameRule
from tickrig.host.monitor.check.rule import Suspects
from tickrig.host.monitor.check.time_rules import BOOT_UP
from tickrig.host.monitor.heard import Heard
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import ALL_NODES, ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand

RESETS: Final = frozenset([NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION])
ERROR_CONTROL_IDS: Final = range(ERROR_CONTROL_COB_ID + 1, ERROR_CONTROL_COB_ID + 0x80)


class NodesPresent(FrameRule):
    """These nodes are heard: boot-up, heartbeat or guarding."""

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
        for node in self._nodes:
            if ERROR_CONTROL_COB_ID + node not in latest_us:
                yield f"node {node} was never heard"


class NoReboot(FrameRule):
    """No node that was heard before boots without an NMT reset."""

    name = "no-reboot"
    suspects = Suspects(first_bytes=RESETS | frozenset(BOOT_UP))

    def __init__(self) -> None:
        self._asked: set[int] = set()

    def wants(self, ident: int, /) -> bool:
        """Take NMT commands and error control."""
        return ident == NMT_COB_ID or ident in ERROR_CONTROL_IDS

    def judge(self, heard: Heard, gap_us: int | None, /) -> str | None:
        """Note a reset; say that a boot-up comes without one."""
        frame = heard.frame
        assert isinstance(frame, CanFrame)
        if frame.can_id == NMT_COB_ID:
            if len(frame.data) == 2 and frame.data[0] in RESETS:
                self._ask(frame.data[1])
            return None
        if frame.data != BOOT_UP:
            return None
        node = frame.can_id & NODE_MASK
        expected = gap_us is None or node in self._asked
        self._asked.discard(node)
        return None if expected else f"node {node} boots again without an NMT reset"

    def _ask(self, node: int) -> None:
        self._asked |= set(range(1, 0x80)) if node == ALL_NODES else {node}
