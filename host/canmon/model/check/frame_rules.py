"""Rules about frames that should not be there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tickrig.host.canmon.model.check.rule import CheckedTraffic, FrameSelection, Rule
from tickrig.host.canmon.model.check.time_rules import (
    ANSWER_IDS,
    BOOT_UP,
    ERROR_CONTROL_IDS,
    REQUEST_IDS,
)
from tickrig.host.canmon.model.frames import ERROR, Record, any_ident, ident_text, sender_of
from tickrig.host.text.values import counted
from tickrig.wire.can import CanFrame, ErrorFrame, describe_error_frame
from tickrig.wire.canopen.emcy import describe
from tickrig.wire.canopen.nmt import ALL_NODES, NMT_COB_ID, NmtCommand
from tickrig.wire.canopen.sdo_frame import FRAME_BYTES, ClientCommand, describe_abort, index_sub

_EMCY_IDS: Final = range(0x081, 0x100)
_NODE_MASK: Final = 0x7F
_CODE_BYTES: Final = 2
_EMCY_BYTES: Final = 8
_NAMED_BYTES: Final = 4
"""An SDO frame of so many bytes names its object."""


class CanopenRule(Rule):
    """A rule about frames that should not be there, among those that may be of CANopen."""

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Say that no frame can be one of CANopen."""
        return evidence.without_canopen


class NoEmcy(CanopenRule):
    """No EMCY but error reset, on the default COB-IDs; one that is cut short is one, too."""

    name = "no-emcy"

    def __init__(self) -> None:
        self._cut = 0

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of EMCY."""
        return ident in _EMCY_IDS

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Name the error."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        data, node = frame.data, frame.can_id & _NODE_MASK
        code = int.from_bytes(data[:_CODE_BYTES], "little")
        if len(data) < _CODE_BYTES:
            self._cut += 1
        if not code or len(data) < _CODE_BYTES:
            return None
        length = "" if len(data) == _EMCY_BYTES else f" ({len(data)} B, {_EMCY_BYTES} are right)"
        return f"node {node}: EMCY {code:04X}h {describe(code)}{length}"

    def notes(self, evidence: CheckedTraffic, /) -> Iterable[str]:
        """Say how many frames are too short to have an error code."""
        if self._cut:
            yield f"{counted(self._cut, 'frame')} of EMCY without a whole error code"


class NoSdoAbort(CanopenRule):
    """No aborted transfer at a default SDO server; an abort that is cut short is one, too."""

    name = "no-sdo-abort"

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of the default servers."""
        return ident in ANSWER_IDS or ident in REQUEST_IDS

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect aborts."""
        return FrameSelection(first_bytes=frozenset([ClientCommand.ABORT]))

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Name object and abort code."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        data = frame.data
        if len(data) < _NAMED_BYTES or data[0] != ClientCommand.ABORT:
            return None
        index, sub = index_sub(data)
        which = f"{index:04X}h:{sub:02X}" if index or sub else "its transfer"
        side = "server" if frame.can_id in ANSWER_IDS else "client"
        reason = describe_abort(int.from_bytes(data[4:], "little"))
        if len(data) < FRAME_BYTES:
            reason = f"without a whole abort code ({len(data)} B, {FRAME_BYTES} are right)"
        node = frame.can_id & _NODE_MASK
        return f"node {node}: {side} aborts {which}, {reason}"


class NoErrorFrames(Rule):
    """No error frame."""

    name = "no-error-frames"

    def wants(self, ident: int, /) -> bool:
        """Take error frames."""
        return ident == ERROR

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Say what failed."""
        frame = record.frame
        assert isinstance(frame, ErrorFrame)
        return describe_error_frame(frame)

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Say that the source has no error frames whatever happened."""
        return evidence.without_errors


class KnownIds(Rule):
    """No other identifiers than these; each other one is told once a bus.

    Args:
        idents: see `ident_of`.
    """

    name = "known"

    def __init__(self, idents: frozenset[int]) -> None:
        self._idents = idents

    def wants(self, ident: int, /) -> bool:
        """Take all others."""
        return ident not in self._idents and ident != ERROR

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect the first frame."""
        return FrameSelection(firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Tell the first frame."""
        return None if gap_us is not None else f"{_text(record)} is not expected"

    def unjudged(self, evidence: CheckedTraffic, /) -> str:
        """Say that there was no identifier."""
        return "" if evidence.seen else "no frame with a CAN-ID came"


def _text(record: Record) -> str:
    assert not isinstance(record.frame, ErrorFrame)
    return ident_text(any_ident(record.frame))


_RESETS: Final = frozenset([NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION])


class NodesPresent(Rule):
    """These nodes are heard: each has sent anything on one of its default COB-IDs."""

    name = "nodes"

    def __init__(self, nodes: Iterable[int]) -> None:
        self._nodes = sorted(nodes)

    def wants(self, ident: int, /) -> bool:
        """Take nothing: what is missing is seen at the end."""
        return False

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Find nothing."""
        return None

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Name those that were never heard."""
        present = set(map(sender_of, latest_us))
        for node in self._nodes:
            if node not in present:
                yield f"node {node} was never heard"


class NoReboot(CanopenRule):
    """No node that was heard before boots without an NMT reset.

    A boot-up is what begins with 0: some nodes send more than its one byte.
    """

    name = "no-reboot"

    def __init__(self) -> None:
        self._commanded: set[int] = set()
        self._present: set[tuple[str, int]] = set()

    def wants(self, ident: int, /) -> bool:
        """Take NMT commands and what nodes send."""
        return ident == NMT_COB_ID or sender_of(ident) is not None

    def selection(self, ident: int, /) -> FrameSelection:
        """Suspect resets and boot-ups; the first frame of anything else tells of its node."""
        if ident == NMT_COB_ID:
            return FrameSelection(first_bytes=_RESETS)
        boot_up = frozenset(BOOT_UP) if ident in ERROR_CONTROL_IDS else frozenset()
        return FrameSelection(first_bytes=boot_up, firsts=True)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        """Note a reset; say that a boot-up comes without one."""
        frame = record.frame
        assert isinstance(frame, CanFrame)
        node = sender_of(frame.can_id)
        if node is None:
            if len(frame.data) == 2 and frame.data[0] in _RESETS:
                self._expect_reset(frame.data[1])
            return None
        is_new = (record.channel, node) not in self._present
        self._present.add((record.channel, node))
        if frame.can_id not in ERROR_CONTROL_IDS or frame.data[:1] != BOOT_UP:
            return None
        expected = is_new or node in self._commanded
        self._commanded.discard(node)
        return None if expected else f"node {node} boots again without an NMT reset"

    def _expect_reset(self, node: int) -> None:
        self._commanded |= set(range(1, 0x80)) if node == ALL_NODES else {node}
