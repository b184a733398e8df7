"""Rules about frames that should not be there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tickrig.host.monitor.check.rule import Suspects
from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.frames.ident import ERROR, ident_of, ident_text
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame, describe_error_frame
from tickrig.wire.canopen.emcy import Emcy, describe
from tickrig.wire.canopen.sdo.abort import describe_abort
from tickrig.wire.canopen.sdo.sdo_command import FRAME_BYTES, ClientCommand
from tickrig.wire.canopen.sdo.sdo_layout import index_sub
from tickrig.wire.errors import WireError

EMCY_IDS: Final = range(0x081, 0x100)
ANSWER_IDS: Final = range(0x581, 0x600)
REQUEST_IDS: Final = range(0x601, 0x680)
NODE_MASK: Final = 0x7F


class FrameRule:
    """A rule that sees all frames it wants, and has nothing to say at the end.

    Attributes:
        name: as findings have it.
    """

    name = ""

    def suspects(self, ident: int, /) -> Suspects:
        """Suspect all."""
        return Suspects()

    def end(self, latest_us: Mapping[int, int], end_us: int, /) -> Iterable[str]:
        """Say nothing."""
        return ()


class NoEmcy(FrameRule):
    """No EMCY but error reset, on the default COB-IDs."""

    name = "no-emcy"

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of EMCY."""
        return ident in EMCY_IDS

    def judge(self, heard: Heard, gap_us: int | None, /) -> str | None:
        """Name the error."""
        frame = heard.frame
        assert isinstance(frame, CanFrame)
        try:
            emcy = Emcy.parse(frame.data)
        except WireError:
            return None
        if not emcy.code:
            return None
        node = frame.can_id & NODE_MASK
        return f"node {node}: EMCY {emcy.code:04X}h {describe(emcy.code)}"


class NoSdoAbort(FrameRule):
    """No aborted transfer at a default SDO server."""

    name = "no-sdo-abort"

    def wants(self, ident: int, /) -> bool:
        """Take the COB-IDs of the default servers."""
        return ident in ANSWER_IDS or ident in REQUEST_IDS

    def suspects(self, ident: int, /) -> Suspects:
        """Suspect aborts."""
        return Suspects(first_bytes=frozenset([ClientCommand.ABORT]))

    def judge(self, heard: Heard, gap_us: int | None, /) -> str | None:
        """Name object and abort code."""
        frame = heard.frame
        assert isinstance(frame, CanFrame)
        data = frame.data
        if len(data) != FRAME_BYTES or data[0] != ClientCommand.ABORT:
            return None
        index, sub = index_sub(data)
        which = f"{index:04X}h:{sub:02X}" if index or sub else "its transfer"
        side = "server" if frame.can_id in ANSWER_IDS else "client"
        reason = describe_abort(int.from_bytes(data[4:], "little"))
        node = frame.can_id & NODE_MASK
        return f"node {node}: {side} aborts {which}, {reason}"


class NoErrorFrames(FrameRule):
    """No error frame."""

    name = "no-error-frames"

    def wants(self, ident: int, /) -> bool:
        """Take error frames."""
        return ident == ERROR

    def judge(self, heard: Heard, gap_us: int | None, /) -> str | None:
        """Say what failed."""
        frame = heard.frame
        assert isinstance(frame, ErrorFrame)
        return describe_error_frame(frame)


class Known(FrameRule):
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

    def suspects(self, ident: int, /) -> Suspects:
        """Suspect the first frame."""
        return Suspects(firsts=True)

    def judge(self, heard: Heard, gap_us: int | None, /) -> str | None:
        """Tell the first frame."""
        return None if gap_us is not None else f"{_text(heard)} is not expected"


def _text(heard: Heard) -> str:
    assert isinstance(heard.frame, CanFrame)
    return ident_text(ident_of(heard.frame))
