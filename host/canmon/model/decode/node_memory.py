"""Knowledge about the objects of one node, from SDO traffic and an EDS.

>>> drive_state(0x0237), drive_state(0x0250), drive_state(0x0010)
('operation enabled', 'switch on disabled', 'not ready to switch on')
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode import decoded
from tickrig.host.canopen.eds import read_sound
from tickrig.host.text.steps import content_lines
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.drive import state_of
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_file import Finding
from tickrig.wire.canopen.eds.eds_writer import VARIABLES
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS
from tickrig.wire.errors import FieldError

# Knowledge about an object: its name, type and unit, with their source; states of a drive.


_STATUSWORD_BITS: Final = {
    "ready_to_switch_on": 0,
    "switched_on": 1,
    "operation_enabled": 2,
    "fault": 3,
    "voltage_enabled": 4,
    "quick_stop": 5,
    "switch_on_disabled": 6,
    "warning": 7,
    "remote": 9,
    "target_reached": 10,
    "internal_limit_active": 11,
}
_CONTROLWORD_BITS: Final = {
    "switch_on": 0,
    "enable_voltage": 1,
    "quick_stop": 2,
    "enable_operation": 3,
    "fault_reset": 7,
    "halt": 8,
}
BITS: Final = {"statusword": _STATUSWORD_BITS, "controlword": _CONTROLWORD_BITS}
"""Names of bits by object, for objects whose bits have names."""


_BY_BITS: Final = tuple(
    "" if (state := state_of(bits)) is None else state.words.lower() for bits in range(0x80)
)


def drive_state(statusword: int) -> str:
    """Return the state of a drive, empty for bits that are not a state."""
    return _BY_BITS[statusword & 0x7F]


_MAX_NUMBER_BYTES: Final = 8

_OTHERS: Final = re.compile(r"[^0-9a-z]+")


class ObjectText(NamedTuple):
    """Description of an object, by which its value is decoded and shown.

    Attributes:
        name: name of the object, as in `Signal.name`.
        kind: data type of the object, or None if it is unknown.
        unit: unit of the value, empty if there is none.
        factor: factor by which the raw number is multiplied to get the value in this unit.
        source: source of the description, as in `Decoded.source`.
        in_hex: whether the value is shown in hexadecimal, as for bit fields and identifiers.
    """

    name: str = ""
    kind: DataType | None = None
    unit: str = ""
    factor: float = 1
    source: str = ""
    in_hex: bool = False

    def fitted(self, data: bytes, *, sized: bool = True) -> bytes:
        """Return the bytes of an object's value, without surplus bytes from an SDO transfer.

        Args:
            data: bytes that were transferred.
            sized: whether the transfer indicated the number of bytes. If False, all surplus bytes
                are removed. If True, surplus bytes are removed only if they are padding, because
                any other bytes may belong to the value.
        """
        kind = self.kind
        if kind is None or not 0 < kind.size < len(data):
            return data
        value, rest = data[: kind.size], data[kind.size :]
        fill = b"\xff" if kind.signed and value[-1] >> 7 else b"\0"
        filled = kind.is_integer and rest == fill * len(rest)
        return value if filled or not sized else data

    def read(self, data: bytes, *, sized: bool = True) -> tuple[Value, str]:
        """Decode the bytes of an object's value, and return the value and its text.

        Surplus bytes are removed first, as by `fitted`. If the bytes do not fit the data type of
        the object, the data type is ignored.

        Args:
            data: bytes that were transferred.
            sized: whether the transfer indicated the number of bytes.
        """
        data = self.fitted(data, sized=sized)
        if self.kind is not None and not self.in_hex:
            try:
                return self._scaled(self.kind.decode(data))
            except FieldError:
                pass
        if self.in_hex or self.kind is None or self.kind.is_integer:
            return _number(data)
        return data, write_bytes(data)

    def _scaled(self, value: Value) -> tuple[Value, str]:
        if isinstance(value, bytes):
            return value, write_bytes(value)
        if isinstance(value, str):
            return value, repr(value.rstrip("\0"))
        if self.factor != 1:
            value *= self.factor
        return value, f"{value:g}" if isinstance(value, float) else str(value)


def _number(data: bytes) -> tuple[Value, str]:
    """Read bytes as a number without a type."""
    if not 1 <= len(data) <= _MAX_NUMBER_BYTES:
        return data, write_bytes(data)
    number = int.from_bytes(data, "little")
    return number, f"0x{number:0{2 * len(data)}X}"


def slug(name: str) -> str:
    """Return a name in the notation of filters.

    >>> slug("Velocity actual value"), slug("COB-ID used by PDO")
    ('velocity_actual_value', 'cob_id_used_by_pdo')
    """
    return _OTHERS.sub("_", name.lower()).strip("_")


def write_bytes(data: bytes) -> str:
    r"""Return some bytes as text, or in hex if they are not text.

    >>> write_bytes(b"EPOS"), write_bytes(b"\x01\xff")
    ("'EPOS'", '01 FF')
    """
    text = data.rstrip(b"\0")
    if text and all(0x20 <= code < 0x7F for code in text):
        return repr(text.decode("ascii"))
    return data.hex(" ").upper()


U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
_TEXT: Final = DataType.VISIBLE_STRING

_PROFILES: Final = 0x6000
_ROWS: Final = [
    (int(index, 16), name, DataType[kind])
    for _, line in content_lines(Path(__file__).with_name("objects.txt").read_text("ascii"))
    for index, kind, name in [line.split()]
]
_ARRAYS: Final = {at: (name[:-2], kind) for at, name, kind in _ROWS if name.endswith("[]")}
_VARIABLES: Final = {at: (name, kind) for at, name, kind in _ROWS if at not in _ARRAYS}
_RECORDS: Final[dict[int, tuple[str, tuple[tuple[str, DataType], ...]]]] = {
    0x1018: ("identity", (("vendor", U32), ("product", U32), ("revision", U32), ("serial", U32)))
}
_SDO: Final = (("request_cob_id", U32), ("response_cob_id", U32), ("node_id", U8))
_PDO: Final = (
    *(("cob_id", U32), ("type", U8), ("inhibit_time", U16)),
    *(("reserved", U8), ("event_timer", U16), ("sync_start", U8)),
)
_RANGES: Final = (
    (range(0x1200, 0x1280), "sdo_server", _SDO),
    (range(0x1280, 0x1300), "sdo_client", _SDO),
    (range(0x1400, 0x1600), "rpdo", _PDO),
    (range(0x1600, 0x1800), "rpdo_mapping", ()),
    (range(0x1800, 0x1A00), "tpdo", _PDO),
    (range(0x1A00, 0x1C00), "tpdo_mapping", ()),
)
_IN_HEX: Final = {
    *("device_type", "error_register", "error_code", "controlword", "statusword"),
    *("vendor", "product", "revision", "serial"),
}


def describe_standard(index: int, sub: int) -> ObjectText | None:
    """Return the description of an object that CiA 301 defines, or None for any other object.

    >>> describe_standard(0x1801, 5).name, describe_standard(0x6041, 0)
    ('tpdo2.event_timer', None)
    """
    if index >= _PROFILES:
        return None
    if index in _VARIABLES:
        return _standard_text(*_VARIABLES[index]) if sub == 0 else None
    if index in _ARRAYS:
        name, kind = _ARRAYS[index]
        return (
            ObjectText(f"{name}.{sub}", kind, in_hex=kind is U32)
            if sub
            else _standard_text(f"{name}.count", U8)
        )
    if index in _RECORDS:
        return _member(*_RECORDS[index], sub)
    for indices, name, members in _RANGES:
        if index in indices:
            return _member(f"{name}{index - indices.start + 1}", members, sub)
    return None


def describe_drive(index: int, sub: int) -> ObjectText | None:
    """Return the description of an object that CiA 402 defines for a drive with one axis.

    The result is None for any other object.

    Args:
        index: index of the object.
        sub: sub-index of the object.
    """
    is_known = index >= _PROFILES and index in _VARIABLES and sub == 0
    return _standard_text(*_VARIABLES[index]) if is_known else None


def _member(name: str, members: tuple[tuple[str, DataType], ...], sub: int) -> ObjectText:
    if sub == 0:
        return _standard_text(f"{name}.count", U8)
    if sub <= len(members):
        member, kind = members[sub - 1]
        return _standard_text(f"{name}.{member}", kind)
    return ObjectText(f"{name}.{sub}", None if members else U32, in_hex=not members)


def _standard_text(name: str, kind: DataType) -> ObjectText:
    return ObjectText(name, kind, in_hex=name.rpartition(".")[2] in _IN_HEX or "cob_id" in name)


@dataclass(frozen=True, slots=True)
class EdsObjects:
    """The content of an EDS file for one node: descriptions and power-on values of its objects.

    Attributes:
        texts: description of each object, by index and sub-index.
        values: power-on value of each object as little-endian bytes, by index and sub-index.
        name: product name of the device. If the file contains none, it is the name of the file.
        findings: errors in the file. Objects with errors are left out.
        vendor: name of the vendor, empty if the file contains none.
    """

    texts: Mapping[Entry, ObjectText] = field(default_factory=dict)
    values: Mapping[Entry, bytes] = field(default_factory=dict)
    name: str = ""
    findings: tuple[Finding, ...] = ()
    vendor: str = ""

    @property
    def heartbeat_ms(self) -> int:
        """Value of 1017h in the file, or 0 without a value."""
        return int.from_bytes(self.values.get(HEARTBEAT_TIME, b""), "little")


def read_eds_objects(path: Path, node_id: int) -> EdsObjects:
    """Read an EDS or DCF file for a node, and return its objects with the node-ID inserted.

    Args:
        path: path of the file.
        node_id: node-ID by which `$NODEID` in the file is replaced.

    Raises:
        OSError: the file cannot be read.
        EdsError: the file has no usable object.
    """
    device, findings = read_sound(path)
    return eds_objects(device, node_id, path.stem, findings)


def eds_objects(
    device: EdsDevice, node_id: int, name: str, findings: tuple[Finding, ...] = ()
) -> EdsObjects:
    """Return the objects of a device from an EDS file that has already been read.

    Args:
        device: device as read from the file.
        node_id: node-ID by which `$NODEID` in the power-on values is replaced.
        name: name for a device without a product name in the file.
        findings: errors in the file.
    """
    return EdsObjects(
        {(row.index, row.sub): _text(device, row) for row in device.entries},
        {
            (row.index, row.sub): row.power_on_data(node_id)
            for row in device.entries
            if row.has_default and row.data_type.is_integer
        },
        device.info.product_name or name,
        findings,
        device.info.vendor_name,
    )


def _text(device: EdsDevice, row: EntryDescription) -> ObjectText:
    name = slug(row.name)
    info = device.objects[row.index]
    if info.code not in VARIABLES:
        name = f"{slug(info.name)}.{name or row.sub}"
    return ObjectText(name, row.data_type, row.unit, row.factor, decoded.EDS)


STORE: Final = 0x1010
_SAVE: Final = b"save"
DEVICE_TYPE: Final = (0x1000, 0)
HEARTBEAT_TIME: Final = (0x1017, 0)
STATUSWORD: Final = (0x6041, 0)
_STATUSWORD_BYTES: Final = 2
_DRIVE_PROFILE: Final = 402
_SEVERAL_PROFILES: Final = 0xFFFF
_DRIVE_WORDS: Final = (0x6040, 0x6041)
_COMMUNICATION: Final = range(0x1000, 0x2000)
"""Objects that determine how other objects are transferred."""

Entry = tuple[int, int]


class NodeMemory:
    """Everything that is known about the objects of one node, from SDO traffic and an EDS file.

    A value that was written to the node is valid until the node boots. After the boot-up, the
    power-on value is valid again. If the node was commanded to store its parameters (1010h) after
    the write, the written value is the new power-on value.

    Args:
        eds: content of the node's EDS file, or None. Its power-on values are valid until the
            traffic contains other values.

    Attributes:
        has_statusword: whether a statusword (6041h) with 16 bits was seen, in an SDO transfer or in
            the mapping of a PDO.
    """

    def __init__(self, eds: EdsObjects | None = None) -> None:
        self.eds = eds or EdsObjects()
        self._power_on: dict[Entry, bytes] = {}
        self._now: dict[Entry, bytes] = {}
        self._written: set[Entry] = set()
        self.has_statusword = False

    def read(self, entry: Entry, data: bytes) -> None:
        """Store a value that was uploaded."""
        self._keep(entry, data)
        # A value that was read before anybody wrote it is what the node booted with.
        if entry not in self._written:
            self._power_on[entry] = data

    def written(self, entry: Entry, data: bytes) -> None:
        """Store the value of a confirmed download."""
        if entry[0] == STORE:
            if data == _SAVE:
                # "save" makes all present values those of the next boot-up, the read ones
                # too.
                self._power_on, self._written = dict(self._now), set()
            return
        self._keep(entry, data)
        self._written.add(entry)

    def _keep(self, entry: Entry, data: bytes) -> None:
        if entry[0] in _COMMUNICATION:
            self._now[entry] = data
        elif entry == STATUSWORD and len(data) == _STATUSWORD_BYTES:
            self.has_statusword = True

    def learn(self, transfer: decoded.Transfer) -> bool:
        """Store the value of a completed SDO transfer. Return whether it had a usable value.

        Failed or incomplete transfers, and transfers with an inconsistency, have no usable value.

        Args:
            transfer: transfer that has ended.
        """
        entry, data = transfer.entry, transfer.data
        if (
            entry is None
            or data is None
            or transfer.flaws
            or transfer.outcome is not decoded.TransferOutcome.DONE
        ):
            return False
        data = self.describe(*entry).fitted(data, sized=transfer.sized)
        if transfer.direction is decoded.TransferDirection.UPLOAD:
            self.read(entry, data)
        else:
            self.written(entry, data)
        return True

    def boot(self) -> bool:
        """Restore the power-on values. Return whether any value changes."""
        changed = self._now != self._power_on
        self._now, self._written = dict(self._power_on), set()
        return changed

    @property
    def indices(self) -> set[int]:
        """The indices of objects with a known value."""
        return {index for values in (self._now, self.eds.values) for index, _ in values}

    def number(self, index: int, sub: int) -> int | None:
        """Return a value as a number, or None if it is unknown."""
        data = self._now.get((index, sub), self.eds.values.get((index, sub)))
        return None if data is None else int.from_bytes(data, "little")

    def was_received(self, entry: Entry) -> bool:
        """Return whether traffic contained a value."""
        return entry in self._now

    def source(self, index: int) -> str:
        """Return where the values of an object come from: SDO traffic, an EDS file, or neither.

        If any value of the object was seen in the traffic, the source is the traffic.

        Args:
            index: index of the object.

        Returns:
            A source as in `Decoded.source`, empty if no value is known.
        """
        entries = [(index, sub) for sub in range(MAX_MAPPED_OBJECTS + 1)]
        if any(entry in self._now for entry in entries):
            return decoded.SEEN
        return decoded.EDS if any(entry in self.eds.values for entry in entries) else ""

    @property
    def boots_otherwise(self) -> bool:
        """Whether a boot-up may change any value."""
        return bool(self._written) or self._now != self._power_on

    @property
    def is_drive(self) -> bool:
        """Whether the node is a drive according to CiA 402.

        The device type (1000h) decides. If the device type is unknown or stands for several
        profiles, the node counts as a drive if it has a statusword (6041h:00) with 16 bits.
        """
        device_type = self.number(*DEVICE_TYPE)
        # 1000h: profile in the low half; FFFFh above it stands for several of them (CiA
        # 301).
        if device_type is None or device_type >> 16 == _SEVERAL_PROFILES:
            return self.has_statusword
        return device_type & 0xFFFF == _DRIVE_PROFILE

    def describe(self, index: int, sub: int) -> ObjectText:
        """Return the description of an object, from an EDS file, or else from CiA 301 or CiA 402.

        There is one exception: if the node is a drive, the descriptions of its controlword and its
        statusword come from CiA 402, even if an EDS file describes them.

        Args:
            index: index of the object.
            sub: sub-index of the object.
        """
        told, standard = self.eds.texts.get((index, sub)), describe_standard(index, sub)
        if told is None:
            told = standard
        elif standard is not None:
            told = told._replace(in_hex=standard.in_hex)
        if self.is_drive and (told is None or index in _DRIVE_WORDS):
            text = describe_drive(index, sub) or ObjectText()
            return text if told is None else text._replace(source=told.source)
        return told or ObjectText()


LATE: Final = 1.5
"""Number of periods after which a heartbeat is late. The real limit is in its consumer (1016h)."""
_GAPS_KEPT: Final = 9


@dataclass(slots=True)
class Heartbeats:
    """Supervision of the heartbeats of one node, which determines their period and detects a loss.

    Args:
        memory: known objects of the node, which may contain 1017h.
        from_boot: whether the time between a boot-up and the first heartbeat also counts as a
            period.

    Attributes:
        last_us: time of the latest report of the NMT state in microseconds, or None before the
            first one.
        since_us: time in microseconds from which the next heartbeat is awaited, or None if none is
            awaited.
        gaps: times between the latest heartbeats in microseconds. A delayed node sends all pending
            heartbeats at once. Therefore a gap shorter than half of the previous gap is averaged
            with that gap, which restores the period.
    """

    memory: NodeMemory = field(compare=False)
    from_boot: bool = True
    last_us: int | None = None
    since_us: int | None = None
    gaps: deque[float] = field(default_factory=lambda: deque(maxlen=_GAPS_KEPT))
    _merged: int = 0  # gaps that the latest of them is the mean of
    _booted: bool = False

    @property
    def by_sdo(self) -> bool:
        """Whether SDO traffic contains 1017h, which takes precedence over measured gaps."""
        return self.memory.was_received(HEARTBEAT_TIME)

    @property
    def learnt(self) -> bool:
        """Whether the period is learnt from the gaps."""
        return bool(self.gaps) and not self.by_sdo

    @property
    def period_us(self) -> int | None:
        """The period of the heartbeats in microseconds, or None if it is unknown.

        If the value of 1017h was seen in SDO traffic, this value is used. Otherwise, the measured
        period is used. If no period was measured, the value of 1017h in an EDS file is used.
        """
        if self.gaps and not self.by_sdo:
            return _median(self.gaps)
        period_ms = self.memory.number(*HEARTBEAT_TIME)
        return period_ms * 1_000 if period_ms else None

    def is_late(self, now_us: int) -> bool:
        """Return whether a heartbeat is missing."""
        period_us = self.period_us
        if self.since_us is None or period_us is None:
            return False
        return now_us - self.since_us > LATE * period_us

    def boot(self, at_us: int) -> None:
        """Restart the supervision after a boot-up."""
        self.gaps.clear()
        self._booted = True
        self.last_us = self.since_us = at_us

    def learn(self, at_us: int, transfer: decoded.Transfer) -> None:
        """Process a transfer of 1017h. A new period restarts the supervision."""
        if transfer.direction is decoded.TransferDirection.DOWNLOAD or self.since_us is None:
            self.gaps.clear()
            self.since_us = at_us

    def take(self, at_us: int, *, learns: bool = True) -> None:
        """Process a heartbeat of the node, and measure the period with it.

        Args:
            at_us: time of the heartbeat in microseconds.
            learns: whether to measure the period. Use False for a frame that may be the answer to a
                guarding request.
        """
        learns = learns and (self.from_boot or not self._booted)
        if learns and self.last_us is not None and at_us > self.last_us:  # logs may repeat a time
            self._take_gap(at_us - self.last_us)
        self.last_us = self.since_us = at_us
        self._booted = False

    def _take_gap(self, gap_us: int) -> None:
        if self.gaps and 2 * gap_us < self.gaps[-1]:
            self.gaps[-1] += (gap_us - self.gaps[-1]) / (self._merged + 1)
            self._merged += 1
        else:
            self.gaps.append(gap_us)
            self._merged = 1


_LEAST_PAIRS: Final = 4
PAIR_US: Final = 100_000
"""Longest time between boot-ups, or answers to one request, that show two nodes."""


class TwoBeats(NamedTuple):
    """Two heartbeats with the same CAN-ID and period, as sent by two nodes with the same node-ID.

    The frames of the two heartbeats alternate. A gap is the time between two successive frames. So
    short and long gaps alternate, and a short gap and the next long gap together are one period.

    Attributes:
        period_us: period of each of the two heartbeats in microseconds.
        places: indices of gaps. Each of these gaps meets two conditions: it differs in length from
            the next gap, and its sum with the next gap is about one period. Gap n begins with
            frame n.
    """

    period_us: int
    places: list[int]


def two_beats(times: Sequence[int]) -> TwoBeats | None:
    """Find two interleaved heartbeats in the times of one CAN-ID. Return None without them.

    >>> two_beats([0, 30, 100, 130, 200, 230, 300, 330]).period_us
    100
    >>> two_beats([0, 100, 200, 300, 400, 500, 600]) is None
    True
    """
    gaps = [b - a for a, b in pairwise(times)]
    pairs = [b - a for a, b in zip(times, times[2:], strict=False)]
    for values in (gaps, pairs):
        if len(values) < _LEAST_PAIRS:
            continue
        period = sorted(values)[len(values) // 2]
        found = [
            at
            for at, pair in enumerate(pairs)
            if abs(pair - period) <= 0.05 * period and abs(gaps[at] - gaps[at + 1]) > 0.2 * period
        ]
        short = sorted(min(gaps[at], gaps[at + 1]) for at in found)
        if len(found) >= _LEAST_PAIRS and short[-1] - short[0] <= 0.1 * period:
            return TwoBeats(period, found)
    return None


def _median(gaps: Collection[float]) -> int:
    """Return the median. Of two middle values, return the higher one.

    The module statistics would take 5 ms to import.
    """
    return round(sorted(gaps)[len(gaps) // 2])
