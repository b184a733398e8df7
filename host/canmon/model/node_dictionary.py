"""The objects of one node with their latest values in the traffic.

>>> encode_value(ObjectText("target_velocity", DataType.INTEGER32), "-2").hex()
'feffffff'
>>> encode_value(ObjectText("angle", DataType.INTEGER16, "deg", 0.1), "1.5").hex()
'0f00'
>>> encode_value(ObjectText(), "37 02").hex()
'3702'
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from math import isfinite
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded, Transfer, TransferOutcome, write_entry
from tickrig.host.canmon.model.decode.node_memory import Entry, NodeMemory, ObjectText
from tickrig.host.canmon.model.decode.pdos import mapped_objects
from tickrig.host.canmon.model.frames import s_text
from tickrig.host.text.values import parse_setting
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS
from tickrig.wire.canopen.sdo_frame import describe_abort
from tickrig.wire.errors import FieldError


class Origin(StrEnum):
    """Source in which a value was seen last."""

    NONE = ""
    EDS = "eds"  # its power-on value
    SDO = "sdo"
    PDO = "pdo"


class ObjectRow(NamedTuple):
    """A row of the object table of a node: one object dictionary entry with its latest value.

    Attributes:
        entry: index and sub-index of the object.
        text: name, type and unit of the object.
        value: latest value for display, empty if unknown.
        origin: source of the value, such as a transfer, a PDO or the EDS.
        at_us: time at which the value was seen, or None for a value of the EDS.
        trouble: reason why the latest SDO transfer failed, empty if it did not fail.
    """

    entry: tuple[int, int]
    text: ObjectText
    value: str = ""
    origin: Origin = Origin.NONE
    at_us: int | None = None
    trouble: str = ""

    @property
    def kind(self) -> str:
        """Data type of the object, empty if unknown."""
        return "" if self.text.kind is None else self.text.kind.name

    def matches(self, wanted: str) -> bool:
        """Return whether the object matches a search text.

        The text must be a part of the object's name, or the beginning of its index.

        >>> row = ObjectRow((0x6041, 0), ObjectText("statusword"))
        >>> [row.matches(wanted) for wanted in ("", "604", "Status", "6041h:00", "word 6", "41")]
        [True, True, True, True, False, False]
        """
        wanted = wanted.lower()
        return write_entry(self.entry).lower().startswith(wanted) or wanted in self.text.name


_FIRST_OBJECT: Final = 0x1000
"""First index of objects. Lower indices are data types (CiA 301, object dictionary structure)."""

_MAPPINGS: Final = {"tpdo": 0x1A00, "rpdo": 0x1600}


class _Observed(NamedTuple):
    """A value with its origin."""

    at_us: int
    value: str
    origin: Origin


class NodeDictionary:
    """The latest known values of the objects of one node, collected from its SDO and PDO traffic.

    Args:
        memory: objects that are known from the EDS of the node and from its SDO traffic.
    """

    def __init__(self, memory: NodeMemory) -> None:
        self.memory = memory
        self._values: dict[Entry, _Observed] = {}
        self._troubles: dict[Entry, str] = {}
        self._pdos: dict[str, tuple[int, Decoded]] = {}

    def take(self, at_us: int, decoded: Decoded) -> None:
        """Process a decoded frame of this node."""
        for transfer in decoded.transfers:
            self._transfer(at_us, transfer)
        if decoded.kind[:4] in _MAPPINGS:
            self._pdos[decoded.kind] = at_us, decoded

    def rows(self, wanted: str = "") -> list[ObjectRow]:
        """Return the rows of the objects that match a search text, ordered by index.

        An empty text matches all objects.
        """
        seen = self._latest()
        entries = sorted({*self.memory.eds.texts, *seen, *self._troubles})
        objects = (entry for entry in entries if entry[0] >= _FIRST_OBJECT)
        rows = (self._row(entry, seen.get(entry)) for entry in objects)
        return [row for row in rows if row.matches(wanted)]

    def _transfer(self, at_us: int, transfer: Transfer) -> None:
        entry = transfer.entry
        if entry is None:
            return
        if transfer.outcome is TransferOutcome.DONE:
            self._troubles.pop(entry, None)
            value = f"{transfer.text}{transfer.unit}"
            self._values[entry] = _Observed(at_us, value, Origin.SDO)
        elif transfer.outcome is TransferOutcome.ABORTED:
            self._troubles[entry] = describe_abort(transfer.abort_code)
        else:
            self._troubles[entry] = transfer.outcome

    def _latest(self) -> dict[Entry, _Observed]:
        """Return the latest values, including values in PDOs."""
        seen = dict(self._values)
        for kind, (at_us, decoded) in self._pdos.items():
            mapped = self._mapped(kind)
            for signal in decoded.signals:
                entry = mapped.get(signal.name)
                if entry is not None and (entry not in seen or seen[entry].at_us <= at_us):
                    value = f"{signal.text or str(signal.value)}{signal.unit}"
                    seen[entry] = _Observed(at_us, value, Origin.PDO)
        return seen

    def _mapped(self, kind: str) -> dict[str, Entry]:
        """Return the objects that a PDO carries, by the names that the decoder uses."""
        index = _MAPPINGS[kind[:4]] + int(kind[4:]) - 1
        count = min(self.memory.number(index, 0) or 0, MAX_MAPPED_OBJECTS)
        found = mapped_objects(self.memory, index, count)
        entries = ((one.index, one.sub) for one in found)
        return {self.memory.describe(*one).name or write_entry(one): one for one in entries}

    def _row(self, entry: Entry, seen: _Observed | None) -> ObjectRow:
        text, trouble = self.memory.describe(*entry), self._troubles.get(entry, "")
        if seen is not None:
            return ObjectRow(entry, text, seen.value, seen.origin, seen.at_us, trouble)
        power_on = self.memory.eds.values.get(entry)
        if power_on is None:
            return ObjectRow(entry, text, trouble=trouble)
        value = f"{text.read(power_on)[1]}{text.unit}"
        return ObjectRow(entry, text, value, Origin.EDS, trouble=trouble)


_LEAST_NAME: Final = 12
_SHORT_NAME: Final = 16
"""Minimum length of a shortened name, however narrow the screen is."""
_MOST_NAME: Final = 36
VALUE: Final = 20
_BESIDE_NAME: Final = 60
"""Width of the other columns."""


def render_dictionary(rows: Sequence[ObjectRow], now_us: int, width: int = 0) -> list[str]:
    """Return the object table of a node as lines of text: a header, and a line for each object.

    If the latest transfer of an object failed, the error is shown in place of the type.

    Args:
        rows: objects to show.
        now_us: present time, from which ages are counted.
        width: width of the screen in columns, which limits the length of names, or 0 for no limit.
    """
    longest = max((len(row.text.name) for row in rows), default=0)
    most = max(_SHORT_NAME, width - _BESIDE_NAME) if width else _MOST_NAME
    name = min(most, max(_LEAST_NAME, longest))
    head = f"{'OBJECT':<9} {'NAME':<{name}} {'VALUE':<{VALUE}} {'FROM':<4} {'AGE':>7}  TYPE"
    return [head, *(_line(row, name, now_us) for row in rows)]


def _shortened(name: str, width: int) -> str:
    """Return a shortened name. The end of a name distinguishes entries, so the end is kept.

    >>> _shortened("pre_defined_error_field.error_1", 20)
    'pre_defin…ld.error_1'
    """
    if len(name) <= width:
        return name
    begin = (width - 1) // 2
    return f"{name[:begin]}…{name[len(name) - (width - 1 - begin) :]}"


def _line(row: ObjectRow, name: int, now_us: int) -> str:
    age = "" if row.at_us is None else f"{s_text(now_us - row.at_us)} s"
    cells = [
        f"{write_entry(row.entry):<9}",
        f"{_shortened(row.text.name, name):<{name}}",
        f"{row.value:<{VALUE}}",
        f"{row.origin:<4}",
        f"{age:>7}",
        f" {row.trouble or row.kind}",
    ]
    return " ".join(cells).rstrip()


_TEXTS: Final = (DataType.VISIBLE_STRING, DataType.UNICODE_STRING, DataType.VISIBLE_CHAR)
_TRUTH: Final = {"true": 1, "false": 0}


def encode_value(text: ObjectText, words: str) -> bytes:
    """Encode a value that the user typed to the bytes of an SDO download.

    The value is written as in the object table, in the unit of the object.

    Args:
        text: known name, type and unit of the object. If the type is unknown, the value must be
            bytes in hex.
        words: typed value. Bytes are in hex.

    Raises:
        ValueError: the text is not a valid value for this object.
    """
    kind = text.kind
    if kind in _TEXTS:
        return kind.encode(words)
    if kind is None or not (kind.is_integer or kind in (DataType.REAL32, DataType.REAL64)):
        return _bytes(words)
    value = _TRUTH.get(words.lower(), parse_setting(words))
    if isinstance(value, str):
        raise ValueError(f"{words!r} is no number; {text.name} is {kind.name}")
    try:
        return kind.encode(_on_the_wire(text, kind, value))
    except (FieldError, OverflowError):
        raise ValueError(f"{words} is not in the range of {kind.name}") from None


def _on_the_wire(text: ObjectText, kind: DataType, value: float) -> float:
    """Return the number to send, which is the nearest step if the object has a factor."""
    if text.factor == 1 or text.in_hex:
        return value
    scaled = value / text.factor
    return round(scaled) if kind.is_integer and isfinite(scaled) else scaled


def _bytes(words: str) -> bytes:
    try:
        return bytes.fromhex(words)
    except ValueError:
        raise ValueError(
            f"{words!r} is not bytes in hex, as 37 02; the type is not known"
        ) from None
