"""What to look at where a check failed: the place in a firmware where such a fault sits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.host.canopen.conform.verdict import Result, Verdict

HINTS: Final[Mapping[str, str]] = {
    "NMT": "the table of NMT states: which command leads where, and what it resets",
    "HB": "objects 1016h and 1017h, and the timers behind them",
    "NG": "objects 100Ch and 100Dh, the toggle bit, and the answer to the remote frame",
    "UE": "the upload of the SDO server: its abort codes, and the size that it tells",
    "DE": "the download of the SDO server: access, size and limits before a value is taken",
    "US": "the segments of an upload: toggle bit, last segment, and when a transfer ends",
    "DS": "the segments of a download: toggle bit, size told and size sent, refusal at once",
    "BD": "the block download: sequence numbers, what is acknowledged, CRC, padding",
    "BU": "the block upload: block size, what is sent again, CRC, end of transfer",
    "SG": "what the SDO server does with requests that it does not know, and while it is busy",
    "PC": "the order of the mapping procedure: PDO off, number 0, entries, number, PDO on",
    "PR": "when a PDO is sent or taken over: transmission type, inhibit time, event timer",
    "SY": "object 1005h, and what a SYNC counter does",
    "EM": "objects 1001h, 1003h, 1014h and 1015h, and when an error counts as gone",
    "EB": "object 1029h, and the state in which an error leaves the node",
    "ST": "objects 1010h and 1011h: their signatures, and what is kept over power-off",
    "LS": "the LSS states, and the identity (1018h) that is compared",
    "IO": "the objects of CiA 401: polarity, filter, interrupts",
    "D4": "the state machine of CiA 402: controlword, statusword, modes",
    "OD": "this object in the EDS, and its row in the object dictionary of the firmware",
}
"""By group."""


def hint(result: Result) -> str:
    """Say where to look, without a full stop; empty where nothing is known."""
    match result.outcome.verdict:
        case Verdict.BLOCKED:
            return "the node: it did not come back; switch it off and on, then run the check alone"
        case Verdict.INCONCLUSIVE:
            return "this host and the bus: load, adapter, other nodes; then run the check alone"
        case _:
            return HINTS.get(result.check.group, "")
