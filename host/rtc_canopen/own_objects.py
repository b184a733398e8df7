"""The objects of the server as a node of its bus (CiA 301; ours: K14, K18)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tickrig.host.rtc_canopen.definition.definition import SystemDefinition
from tickrig.wire.canopen.cob_id import FLAG_30
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import (
    Abort,
    DownloadInitiateRequest,
    Request,
    UploadInitiateRequest,
    UploadInitiateResponse,
    parse_request,
)
from tickrig.wire.errors import WireError

DEVICE_TYPE: Final = 460
"""A marker of ours: the number of the profile whose text is not public."""

CONSUMERS: Final = 3
"""A heartbeat may be so many producer times late."""

SYNC_COB_ID: Final = 0x080
"""The default of 1005h (CiA 301, SYNC)."""

MOST_MS: Final = 0xFFFF

Table = Mapping[tuple[int, int], bytes]


class OwnObjects:
    """Answers who reads the server's objects by SDO.

    | object | what |
    |---|---|
    | 1000h | device type, 000001CCh |
    | 1001h | error register, 0 |
    | 1005h, 1006h | COB-ID SYNC, with bit 30 if it sends it; communication cycle period, us |
    | 1016h | consumer heartbeat time of each node |
    | 1017h | producer heartbeat time |
    | 1018h | identity: vendor-ID 0, which is nobody's |

    Not emulated: writing, segments and blocks; every object has at most four bytes.

    Args:
        definition: what the server was told.
    """

    def __init__(self, definition: SystemDefinition) -> None:
        consumed = [
            node.id << 16 | min(CONSUMERS * node.heartbeat_ms, MOST_MS) for node in definition.nodes
        ]
        sync_ms = definition.master.sync_ms
        self._table: Table = {
            (0x1000, 0): _u32(DEVICE_TYPE),
            (0x1001, 0): bytes(1),
            (0x1005, 0): _u32(SYNC_COB_ID | bool(sync_ms) * FLAG_30),
            (0x1006, 0): _u32(1_000 * sync_ms),
            **_array(0x1016, map(_u32, consumed)),
            (0x1017, 0): definition.master.heartbeat_ms.to_bytes(2, "little"),
            **_array(0x1018, [_u32(0)]),
        }
        self._indices = frozenset(index for index, _ in self._table)

    def answer(self, data: bytes) -> bytes | None:
        """Return the answer to a request; None to an abort, and to what is no request."""
        try:
            request = parse_request(data)
        except WireError:
            return None
        return None if isinstance(request, Abort) else self._answer(request)

    def _answer(self, request: Request) -> bytes:
        match request:
            case UploadInitiateRequest(index=index, sub=sub):
                return self._upload(index, sub)
            case DownloadInitiateRequest(index=index, sub=sub):
                code = self._missing(index, sub) or AbortCode.READ_ONLY
                return Abort(index, sub, code).encode()
        return Abort(0, 0, AbortCode.COMMAND_SPECIFIER).encode()

    def _upload(self, index: int, sub: int) -> bytes:
        if (code := self._missing(index, sub)) is not None:
            return Abort(index, sub, code).encode()
        value = self._table[index, sub]
        return UploadInitiateResponse(index, sub, value, len(value)).encode()

    def _missing(self, index: int, sub: int) -> AbortCode | None:
        if index not in self._indices:
            return AbortCode.NO_OBJECT
        return None if (index, sub) in self._table else AbortCode.NO_SUBINDEX


def _array(index: int, values: Iterable[bytes]) -> Table:
    """Return an array or record with its number of entries."""
    entries = list(values)
    numbered = {(index, sub): value for sub, value in enumerate(entries, 1)}
    return {(index, 0): bytes((len(entries),)), **numbered}


def _u32(value: int) -> bytes:
    return value.to_bytes(4, "little")
