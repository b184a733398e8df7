"""Permissions of a level, checked for each frame sent to the bus."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Disturbed, NotAllowed
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.notation import NMT_TO_ALL, SYNC_TO_ALL, begins_download
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.lss import LSS_MASTER_COB_ID
from tickrig.wire.canopen.nmt import ALL_NODES, NMT_COB_ID, NmtCommand
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, SPECIFIER, ClientCommand, index_sub

_UPLOADS: Final = (
    ClientCommand.UPLOAD,
    ClientCommand.UPLOAD_SEGMENT,
    ClientCommand.BLOCK_UPLOAD,
    ClientCommand.ABORT,
)

PROFILE: Final = 0x6000
MANUFACTURER: Final = 0x2000
PROGRAMS: Final = range(0x1F50, 0x1F5A)
"""Indices of program download and control, which the tester never uses."""
SWITCH_GLOBAL, CONFIGURATION = 0x04, 0x01
_CONFIGURES: Final = (0x11, 0x13, 0x15, 0x17)
"""LSS services that change a node: node-ID, bit timing, activation of bit timing, and storing."""
STORAGE: Final = (0x1010, 0x1011)
_FRAME_BYTES: Final = 8

_Confirm = Callable[[str], bool]


class Permission:
    """Rules that decide whether a run may send a frame to the bus. Every frame is checked.

    Args:
        level: level of the run.
        allow: indices of objects in the profile area (6000h and above) that the user allows to be
            written.
        node_id: node-ID of the node under test.
        confirm: function that asks the user a question. It is called once for each kind of action
            that concerns other nodes or cannot be undone.
        never: indices of objects that must never be written.

    Attributes:
        others: node-IDs of other nodes on the bus.
    """

    def __init__(
        self,
        level: Level,
        allow: Collection[int],
        node_id: int,
        confirm: _Confirm,
        never: Collection[int] = (),
    ) -> None:
        self._level, self._allow, self._never = level, allow, never
        self._request = REQUEST_COB_ID + node_id
        self._confirm = confirm
        self._answers: dict[str, bool] = {}
        self.others: frozenset[int] = frozenset()
        self._all_configured = False

    def check(self, frame: CanFrame) -> None:
        """Check that the run may send a frame.

        Raises:
            NotAllowed: the level does not allow the frame.
            Disturbed: the frame would also change other nodes.
        """
        is_request = frame.can_id == self._request and not frame.extended
        if self._level is Level.READ_ONLY:
            if not is_request or frame.remote or not _is_upload(frame.data):
                raise NotAllowed(f"{frame} does more than read: --communication")
        elif is_request:
            if self._never:
                self._check_request(frame.data)
        elif frame.can_id == NMT_COB_ID and not frame.extended:
            self._check_nmt(frame.data)
        elif frame.can_id == LSS_MASTER_COB_ID and self._level < Level.INTRUSIVE:
            raise NotAllowed("LSS may change the node-ID: --intrusive")
        elif frame.can_id == LSS_MASTER_COB_ID and not frame.extended:
            self._check_lss(frame.data)

    def check_write(self, index: int, *, refused: bool = False) -> None:
        """Check that the run may write an object.

        Args:
            index: index of the object, 0x0000..0xFFFF.
            refused: whether the check expects the node to refuse the write.

        Raises:
            NotAllowed: the level or the options of the run do not allow the write.
        """
        self._check_never(index)
        if index in PROGRAMS:
            raise NotAllowed(f"{index:04X}h belongs to program download, which is never written")
        if index >= PROFILE and index not in self._allow:
            raise NotAllowed(f"{index:04X}h may move something: --allow {index:04X}h")
        beyond = index in STORAGE or (MANUFACTURER <= index < PROFILE and not refused)
        if beyond and self._level < Level.INTRUSIVE:
            raise NotAllowed(f"{index:04X}h would be written with a valid value: --intrusive")

    def check_confirmed(self, question: str) -> None:
        """Check that the user agrees to an action. The user gets each question only once.

        SYNC messages need no agreement if no other node is on the bus.

        Raises:
            NotAllowed: the user does not agree.
        """
        if question == SYNC_TO_ALL and not self.others:
            return
        if question not in self._answers:
            self._answers[question] = self._confirm(question)
        if not self._answers[question]:
            raise NotAllowed(f"would {question}: not confirmed (--yes)")

    def _check_request(self, data: bytes) -> None:
        if len(data) == _FRAME_BYTES and begins_download(data[0]):
            self._check_never(index_sub(data)[0])

    def _check_never(self, index: int) -> None:
        if index in self._never:
            raise NotAllowed(f"{index:04X}h must not be written: --never {index:04X}h")

    def _check_nmt(self, data: bytes) -> None:
        if data[:1] == bytes([NmtCommand.RESET_NODE]) and self._level < Level.INTRUSIVE:
            raise NotAllowed("resets the node: --intrusive")
        if data[1:2] == bytes([ALL_NODES]):
            self.check_confirmed(NMT_TO_ALL)

    def _check_lss(self, data: bytes) -> None:
        """Raise an error if other nodes would execute an LSS command to all configuring slaves."""
        if data[:1] == bytes([SWITCH_GLOBAL]):
            self._all_configured = data[1:2] == bytes([CONFIGURATION])
        elif self._all_configured and self.others and data[:1] and data[0] in _CONFIGURES:
            others = ", ".join(map(str, sorted(self.others)))
            raise Disturbed(f"other nodes would also execute LSS {data[0]:02X}h: {others}")


def _is_upload(data: bytes) -> bool:
    return bool(data) and data[0] & SPECIFIER in _UPLOADS
