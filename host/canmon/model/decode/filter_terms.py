"""The signals that a filter asks for and that have not come: a name may be misspelt."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable
from typing import Final

from tickrig.host.canmon.model.decode.decoded import (
    DBC,
    EDS,
    SEEN,
    Decoded,
    Signal,
    TransferOutcome,
)
from tickrig.host.canmon.model.decode.object_text import BITS
from tickrig.host.canmon.model.frames import AnyRecord, CandumpFilter, Record, flagged_id
from tickrig.wire.can import EXTENDED_MAX, MAX_FD_BYTES, CanFrame, ErrorFrame, FdFrame
from tickrig.wire.canopen.nmt import NmtState

Test = Callable[[AnyRecord, Decoded], bool]
_Compare = Callable[[float, float], bool]

COMPARISONS: Final[dict[str, _Compare]] = {
    "=": operator.eq,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
EQUALITIES: Final = ("=", "==", "!=")
KINDS: Final = (
    *("nmt", "sync", "time", "emcy", "heartbeat", "boot-up", "guard", "sdo", "lss", "dbc"),
    *("unmapped", "raw", "error", "rrc", "rtc-lite"),
)
_FD_KINDS: Final[dict[str, Callable[[FdFrame], bool]]] = {
    "fd": lambda frame: True,
    "brs": lambda frame: frame.brs,
    "esi": lambda frame: frame.esi,
}
_OUTCOMES: Final = {
    "sdo.aborted": TransferOutcome.ABORTED,
    "sdo.unanswered": TransferOutcome.UNANSWERED,
    "sdo.broken": TransferOutcome.BROKEN,
}
FIELDS: Final[dict[str, Callable[[AnyRecord, Decoded], int | None]]] = {
    "node": lambda record, decoded: decoded.node,
    "id": lambda record, decoded: _can_id(record),
    "dlc": lambda record, decoded: getattr(record.frame, "dlc", None),
    "bytes": lambda record, decoded: None if record.frame is None else len(record.frame.data),
}
WORDS: Final[dict[str, Callable[[AnyRecord, Decoded], str]]] = {
    "channel": lambda record, decoded: record.channel,
    "kind": lambda record, decoded: decoded.kind,
    "dir": lambda record, decoded: "tx" if record.sent else "rx",
    "src": lambda record, decoded: decoded.source,
}

HIGHEST_NODE: Final = 127
RANGES: Final = {
    "node": range(1, HIGHEST_NODE + 1),
    "id": range(EXTENDED_MAX + 1),
    "dlc": range(16),
    "bytes": range(MAX_FD_BYTES + 1),
}
"""What the numbers of `FIELDS` can be."""
KNOWN_WORDS: Final = {"kind": (*KINDS, "fd"), "dir": ("rx", "tx"), "src": (EDS, SEEN, DBC)}
"""What the words of `WORDS` can be, beside PDOs by their numbers."""
FREE: Final = ("kind", "src")
"""Decoders of installed packages may say others."""
_ERROR_CONTROL: Final = ("boot-up", "heartbeat", "guard")
NMT_STATES: Final = {state.name.lower().replace("_", "-"): int(state) for state in NmtState}

_STATE: Final = re.compile(r"state of node ([0-9]+)")
_BIT: Final = re.compile(r"[0-9]{1,2}")
_HEX: Final = re.compile(r"(-?)([0-9][0-9A-Fa-f]*)h")
_PDO: Final = re.compile(r"([tr]?)pdo([0-9]{0,3})")
_NODE: Final = re.compile(r"([0-9]{1,3})\.(.+)")


def kind_test(word: str) -> Test | None:
    """Return the test for a kind of frame, or for how an SDO transfer ended."""
    if word in _FD_KINDS:
        test = _FD_KINDS[word]
        return lambda record, decoded: isinstance(record.frame, FdFrame) and test(record.frame)
    if word in KINDS:
        return lambda record, decoded: decoded.kind == word
    if word in _OUTCOMES:
        outcome = _OUTCOMES[word]
        return lambda record, decoded: any(t.outcome is outcome for t in decoded.transfers)
    match = _PDO.fullmatch(word)
    if match is None:
        return None
    directions = (match[1],) if match[1] else ("t", "r")
    unmapped = ("unmapped",) if word == "pdo" else ()
    if match[2]:
        kinds = tuple(f"{direction}pdo{match[2]}" for direction in directions)
        return lambda record, decoded: decoded.kind in kinds
    begins = (*(f"{direction}pdo" for direction in directions), *unmapped)
    return lambda record, decoded: decoded.kind.startswith(begins)


def state_path(node: int) -> str:
    """Return the name under which the NMT state of a node is waited for."""
    return f"state of node {node}"


def state_test(nodes: range, state: int) -> Test:
    """Return the test for nodes that tell an NMT state."""
    return lambda record, decoded: (
        decoded.node in nodes
        and decoded.kind in _ERROR_CONTROL
        and any(signal.value == state for signal in decoded.signals)
    )


def object_test(index: int, sub: int | None) -> Test:
    """Return the test for SDO frames about an object."""

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        entries = (decoded.entry, *(transfer.entry for transfer in decoded.transfers))
        return any(entry and entry[0] == index and sub in (None, entry[1]) for entry in entries)

    return test


def range_test(low: int, high: int, *, extended: bool) -> Test:
    """Return the test for CAN-IDs, both ends included."""

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        frame = record.frame
        if not isinstance(frame, CanFrame | FdFrame) or frame.extended != extended:
            return False
        return low <= frame.can_id <= high

    return test


def error_test(mask: int) -> Test:
    """Return the test for error frames of some classes."""
    return lambda record, decoded: (
        isinstance(record.frame, ErrorFrame) and bool(record.frame.error_class & mask)
    )


def candump_test(chosen: CandumpFilter) -> Test:
    """Return the test of candump's rules."""
    return lambda record, decoded: isinstance(record, Record) and chosen.passes(flagged_id(record))


def never_holds(name: str, sign: str, value: float) -> bool:
    """Say whether a field can never be compared so: somebody must have meant something else."""
    numbers, compare = RANGES[name], COMPARISONS[sign]
    if sign in EQUALITIES:
        return value not in numbers
    return not (compare(numbers[0], value) or compare(numbers[-1], value))


def is_word(name: str, value: str) -> bool:
    """Say whether a field may have a word."""
    is_pdo = name == "kind" and _PDO.fullmatch(value) is not None and value[-1:].isdecimal()
    return name not in KNOWN_WORDS or value in KNOWN_WORDS[name] or is_pdo


def field_test(name: str, compare: _Compare, value: float) -> Test:
    """Return the test for a number that every frame of some kind has."""
    field = FIELDS[name]

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        found = field(record, decoded)
        return found is not None and compare(found, value)

    return test


def word_test(name: str, sign: str, value: str) -> Test:
    """Return the test for a word."""
    word, wanted = WORDS[name], sign != "!="
    return lambda record, decoded: (word(record, decoded) == value) == wanted


def signal_test(path: str, sign: str = "!=", text: str = "0") -> Test:
    """Return the test for a signal, or one bit of it; without a comparison: it is not 0.

    Args:
        path: name, with `.bit` or its number behind it and `node.` before it if need be.
        sign: one of `COMPARISONS`.
        text: what it is compared with.
    """
    find, compare = signal_reader(path), comparison(sign, text)

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        signal = find(decoded)
        return signal is not None and compare(signal)

    return test


def signal_reader(path: str) -> Callable[[Decoded], Signal | None]:
    """Return what finds a signal, or one bit of it, in a frame; None where it is not there.

    Args:
        path: see `signal_test`.
    """
    if match := _STATE.fullmatch(path):
        return _state_reader(int(match[1]))
    node, whole, shift = signal_place(path)
    base, _, digits = whole.rpartition(".")
    number = int(digits) if base and _BIT.fullmatch(digits) else None

    def find(decoded: Decoded) -> Signal | None:
        if node is not None and decoded.node != node:
            return None
        for signal in decoded.signals:
            if signal.name == whole:
                return signal if shift is None else _bit(signal, shift)
            if number is not None and signal.name == base:
                return _bit(signal, number)
        return None

    return find


def _state_reader(node: int) -> Callable[[Decoded], Signal | None]:
    return lambda decoded: (
        decoded.signals[0]
        if decoded.node == node and decoded.kind in _ERROR_CONTROL and decoded.signals
        else None
    )


def signal_place(path: str) -> tuple[int | None, str, int | None]:
    """Return node, name, and bit of a signal that a filter asks for; None where it names none.

    >>> signal_place("3.statusword.fault"), signal_place("position")
    ((3, 'statusword', 3), (None, 'position', None))
    """
    match = _NODE.fullmatch(path)
    node, name = (int(match[1]), match[2]) if match else (None, path)
    base, _, bit = name.rpartition(".")
    shift = BITS.get(base, {}).get(bit)
    return node, name if shift is None else base, shift


def number(text: str) -> float | None:
    """Read a number as people write it; None if it is none.

    >>> number("0x10"), number("-1.5"), number("8130h"), number("fast")
    (16, -1.5, 33072, None)
    """
    match = _HEX.fullmatch(text)
    if match:
        return int(match[1] + match[2], 16)
    if not text.isascii() or "_" in text:
        return None
    for kind in (_whole, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return None


def _whole(text: str) -> int:
    return int(text, 0)


def comparison(sign: str, text: str) -> Callable[[Signal], bool]:
    """Return what compares a signal, by its number or its text.

    Args:
        sign: one of `COMPARISONS`; of `EQUALITIES` where the text is no number.
        text: what it is compared with.
    """
    wanted, compare = number(text), COMPARISONS[sign]
    if wanted is None:
        words, equal = text.lower(), sign != "!="
        return lambda signal: (words in (signal.text.lower(), str(signal.value).lower())) == equal

    def holds(signal: Signal) -> bool:
        value = signal.value
        return isinstance(value, int | float) and compare(value, wanted)

    return holds


def _bit(signal: Signal, shift: int) -> Signal:
    """Return one bit of a signal; nothing comparable where it is no number."""
    value = signal.value
    return Signal(signal.name, value >> shift & 1 if isinstance(value, int) else "")


def _can_id(record: AnyRecord) -> int | None:
    return record.frame.can_id if isinstance(record.frame, CanFrame | FdFrame) else None


class MissingSignals:
    """Waits for signals by name, and for words that no decoder of ours says.

    Args:
        paths: as filters write them: `position`, `3.position`, `statusword.fault`.
        words: field and word, as `Filter.words` has them.
    """

    def __init__(self, paths: Iterable[str], words: Iterable[tuple[str, str]] = ()) -> None:
        self._left = {path: signal_reader(path) for path in sorted(paths)}
        self._words = sorted(words)

    def __bool__(self) -> bool:
        """Say whether any is missing."""
        return bool(self._left or self._words)

    def take(self, record: AnyRecord, decoded: Decoded) -> None:
        """Take what a frame says."""
        if decoded.signals:
            left = self._left.items()
            self._left = {path: find for path, find in left if find(decoded) is None}
        if self._words:
            self._words = [
                word for word in self._words if WORDS[word[0]](record, decoded) != word[1]
            ]

    @property
    def paths(self) -> list[str]:
        """Those that have not come."""
        return list(self._left)

    @property
    def words(self) -> list[str]:
        """Those that have not come, as `kind=word`."""
        return [f"{name}={word}" for name, word in self._words]

    def messages(self) -> list[str]:
        """Say what never came, one line each."""
        signals = [f"the filter asks for {path!r}: no such signal came" for path in self._left]
        return signals + [
            f"the filter asks for {name}={word}: no such frame came;"
            f" there are {', '.join(KNOWN_WORDS[name])}"
            for name, word in self._words
        ]
