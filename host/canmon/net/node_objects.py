"""The objects of a node by name, from its EDS, or else with names of CiA 301 and CiA 402."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.host.canmon.eds_document import chosen_eds, read_device_document, read_number
from tickrig.host.canmon.model.decode import node_memory
from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.canmon.model.decode.eds_folder import EdsFolder
from tickrig.host.canmon.model.decode.node_memory import NodeMemory, eds_objects
from tickrig.host.canmon.model.node_dictionary import encode_value
from tickrig.host.canmon.net.session import NetSession, NodeFailed, failure_text
from tickrig.host.canopen.commissioning.configuration import Values, dcf_values, same
from tickrig.host.canopen.conform.subject import TOLD, other_device
from tickrig.host.canopen.errors import SdoAborted, SdoTimeout
from tickrig.host.cli.messages import Refused, say
from tickrig.host.text.names import near
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds import object_table
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.pdo import PdoDescription

# Names of CiA 301 as an EDS writes them in full, for nodes of which there is none.

_PDOS: Final = 64
"""Number of PDOs per direction that have names."""


@cache
def _standard_names() -> Mapping[str, tuple[int, int]]:
    """Return index and sub-index of the communication objects by name.

    >>> _standard_names()["identity_object.product_code"] == (0x1018, 2)
    True
    """
    table, pdos = object_table.ObjectTable(), [PdoDescription(object_table.OFF)] * _PDOS
    profile = object_table.CommunicationProfile(
        device_type=0, name="", hardware="", software="", product_code=0, rpdos=pdos, tpdos=pdos
    )
    object_table.add_communication(table, profile)
    found: dict[str, tuple[int, int]] = {}
    for row in table:
        head = table.objects[row.index]
        whole = (
            "" if head.code is object_table.ObjectCode.VAR else f"{node_memory.slug(head.name)}."
        )
        found[f"{whole}{node_memory.slug(row.name)}"] = row.index, row.sub
    return found


Entry = tuple[int, int]

_ADDRESS: Final = re.compile(
    r"(?:0x)?([0-9a-f]{4})h?(?:(?::|sub|/)(?:0x)?([0-9a-f]{1,2})h?)?", re.IGNORECASE
)
_COMMUNICATION: Final = range(0x1000, 0x2000)
_DRIVE: Final = range(0x6000, 0x6100)
_SUBS: Final = range(9)
"""Sub-indices of objects with names in CiA 301, used without an EDS."""


class NamedObjects:
    """Names, types and units of the objects of one node, as its EDS describes them.

    Args:
        node_id: node-ID of the node.
        file: EDS file of the node, or None for no file.
        known: description of the device, used only if `file` is None. None if there is no
            description.
        name: name of the EDS that the description `known` was made from.

    Attributes:
        node_id: node-ID of the node.
        file: EDS of the node, or None for no file.
        device: device that the EDS describes.
        rows: entries of the device by index and sub-index.
    """

    def __init__(
        self,
        node_id: int,
        file: EdsFile | None = None,
        known: EdsDevice | None = None,
        name: str = "",
    ) -> None:
        self.node_id, self.file = node_id, file
        self.device = device = known if file is None else read_device(file)
        name = name if file is None else file.name
        eds = None if device is None else eds_objects(device, node_id, Path(name).stem)
        self._memory = NodeMemory(eds)
        entries = device.entries if device is not None else ()
        self.rows: dict[Entry, object_table.EntryDescription] = {
            (one.index, one.sub): one for one in entries
        }

    @property
    def is_drive(self) -> bool:
        """Whether the node is known to be a CiA 402 drive."""
        return self._memory.is_drive

    def learn(self, entry: Entry, data: bytes) -> None:
        """Store a value read from the node, such as its device type."""
        self._memory.read(entry, data)

    def text(self, entry: Entry) -> node_memory.ObjectText:
        """Return name, type and unit of an object."""
        return self._memory.describe(*entry)

    def size(self, entry: Entry) -> int:
        """Return the size of an object in bytes, as the EDS gives it.

        The size is 0 if it varies or is unknown.
        """
        kind = self.text(entry).kind
        return 0 if kind is None else kind.size

    def title(self, entry: Entry) -> str:
        """Return index, sub-index and name of an object as text."""
        return f"{write_entry(entry)} {self.text(entry).name}".rstrip()

    def find(self, word: str) -> Entry:
        """Return index and sub-index of the object that the user named.

        The text is a name or an index, such as `statusword`, `1018h:1` or `0x6041`.

        Raises:
            Refused: the object does not exist.
        """
        if (entry := self._names.get(word.casefold())) is not None:
            return entry
        if match := _ADDRESS.fullmatch(word):
            return int(match[1], 16), int(match[2] or "0", 16)
        raise Refused(
            f"no object {word!r} of node {self.node_id}; {near(word.casefold(), self._names)}"
            " An index is written 6041h, or 1018h:1"
        )

    def dcf_values(self) -> Values:
        """Return the values that the file of the node configures."""
        assert self.file is not None
        assert self.device is not None
        return dcf_values(self.file, self.device, self.node_id)

    @cached_property
    def _names(self) -> Mapping[str, Entry]:
        if not self.rows:
            return _names_by_standard(self.is_drive)
        found: dict[str, Entry] = {}
        for entry in sorted(self.rows):
            if name := self.text(entry).name:
                found.setdefault(name, entry)
        for entry in self.rows:  # those of the standards mean the same object, where it is there
            standard = node_memory.describe_standard(*entry)
            if standard is None and self.is_drive:
                standard = node_memory.describe_drive(*entry)
            if standard is not None:
                found.setdefault(standard.name, entry)
        for name, entry in _standard_names().items():
            if entry in self.rows:
                found.setdefault(name, entry)
        return found


@cache  # 0.1 s where a node has no EDS
def _names_by_standard(is_drive: bool) -> Mapping[str, Entry]:
    """Return the objects with names in CiA 301, and in CiA 402 for a drive."""
    found: dict[str, Entry] = {}
    for index in _COMMUNICATION:
        for sub in _SUBS:
            if (text := node_memory.describe_standard(index, sub)) is not None:
                found.setdefault(text.name, (index, sub))
    for index in _DRIVE if is_drive else ():
        if (text := node_memory.describe_drive(index, 0)) is not None:
            found.setdefault(text.name, (index, 0))
    return {**found, **_standard_names(), **found}  # in this order: a mistake lists the first


DEVICE_TYPE: Final = (0x1000, 0)


def known_objects(
    session: NetSession,
    node_id: int,
    eds: Path | EdsFolder | None,
    *,
    what: str = "--eds",
    strict: bool = False,
) -> NamedObjects:
    """Return the names and types of the objects of a node, from the EDS that describes it.

    The function reads the device type from the node. If there is an EDS, it also reads the
    identity.

    Args:
        session: session with the open bus.
        node_id: node-ID of the node.
        eds: EDS file of the node, or a folder in which the file is searched.
        what: option or argument that gave the EDS, for messages.
        strict: whether to refuse an EDS that describes another device. Otherwise, the function
            prints a warning.

    Raises:
        Refused: the EDS cannot be used.
        SdoFailed: the node does not answer.
    """
    eds = chosen_eds(eds, session.bus, node_id)
    if eds is not None:
        objects = NamedObjects(node_id, read_device_document(eds, what).file)
    else:
        known = session.source.describe(node_id)
        name = session.source.eds.get(node_id, "")
        objects = NamedObjects(node_id, None, known and known.device, name)
    data = _device_type(session, node_id)
    objects.learn(DEVICE_TYPE, data)
    if eds is not None:
        about = {"device type": f"{int.from_bytes(data, 'little'):08X}h"}
        for name, at in list(TOLD.items())[1:]:
            if (number := read_number(session.bus, node_id, *at)) is not None:
                about[name] = f"{number:08X}h"
        if text := other_device(objects.device, about):
            if strict:
                raise Refused(f"node {node_id}: {text}; --other-device takes it all the same")
            say(f"warning: node {node_id}: {text}")
    return objects


def _device_type(session: NetSession, node_id: int) -> bytes:
    try:
        return session.bus.read(node_id, *DEVICE_TYPE, 4)
    except SdoTimeout as error:
        within = f"no answer within {error.timeout_us // 1_000} ms"
        text = f"node {node_id}: {within} to the read of 1000h that each node has"
        raise NodeFailed(text) from None


_TYPES: Final = {
    "bool": DataType.BOOLEAN,
    **{f"i{bits}": DataType[f"INTEGER{bits}"] for bits in (8, 16, 24, 32, 40, 48, 56, 64)},
    **{f"u{bits}": DataType[f"UNSIGNED{bits}"] for bits in (8, 16, 24, 32, 40, 48, 56, 64)},
    "f32": DataType.REAL32,
    "f64": DataType.REAL64,
    "text": DataType.VISIBLE_STRING,
    "hex": DataType.OCTET_STRING,
}
"""Names of types that you can write before a value without an EDS, as in `u16:5`."""


# Values of objects in the notation of users, and their comparison.


# Values of objects in the notation of users.

_STATUSWORD: Final = (0x6041, 0)
_MOST_SHOWN: Final = 64
"""Largest number of bytes of a domain that are shown.

For a longer domain, only the size is shown.
"""


def shown(objects: NamedObjects, entry: Entry, data: bytes) -> str:
    """Return the value of an object as text with its unit, for the output of a command.

    Integers are also shown in hex. Identifiers and bit fields are shown only in hex.
    """
    text = objects.text(entry)
    if len(data) > _MOST_SHOWN and (text.kind is None or text.kind is DataType.DOMAIN):
        return f"{len(data)} bytes, {data[:8].hex(' ').upper()} ..."
    value, said = text.read(data)
    if entry == _STATUSWORD and objects.is_drive and isinstance(value, int):
        return f"{said} {node_memory.drive_state(value)}"
    if text.in_hex or text.kind is None:
        return said
    unit = f" {text.unit}" if text.unit else ""
    if text.kind.is_integer and text.kind is not DataType.BOOLEAN:
        return f"{said}{unit} (0x{int.from_bytes(data, 'little'):0{2 * len(data)}X})"
    return f"{said}{unit}"


def encoded(objects: NamedObjects, entry: Entry, words: str) -> bytes:
    """Encode a value that the user typed to the bytes of an object.

    The value is written as `100`, `0x64`, `u16:100`, or `-1.5` in the unit of the object.

    Raises:
        Refused: the text is not a valid value for the object.
    """
    text = objects.text(entry)
    kind, colon, rest = words.partition(":")
    if colon and kind in _TYPES:
        text, words = node_memory.ObjectText(text.name, _TYPES[kind]), rest
    if text.kind is None:
        raise Refused(
            f"the type of {objects.title(entry)} is not known: give its EDS (--eds FILE), or the"
            f" type before the value, as u16:100; types: {', '.join(_TYPES)}"
        )
    try:
        return encode_value(text, words)
    except ValueError as error:
        raise Refused(f"{objects.title(entry)}: {error}{_range(text)}") from None


def _range(text: node_memory.ObjectText) -> str:
    """Return the allowed range of a whole number, for a message."""
    kind = text.kind
    if kind is None or not kind.is_integer:
        return ""
    low = -(1 << kind.bits - 1) if kind.signed else 0
    high = (1 << kind.bits - kind.signed) - 1
    factor = text.factor
    return f" ({low * factor:g} to {high * factor:g})" if factor != 1 else f" ({low} to {high})"


def limits(objects: NamedObjects, entry: Entry) -> str:
    """Return the range of values that the EDS allows for an object, as text.

    The caller appends the text, such as `; the EDS allows 0 to 9`, to an error message. The text is
    empty if the EDS gives no range.
    """
    row = objects.rows.get(entry)
    if row is None or (row.low is None and row.high is None):
        return ""
    low, high = ("..." if bound is None else f"{bound}" for bound in (row.low, row.high))
    return f"; the EDS allows {low} to {high}"


# Comparison of a node's values with those of a DCF or of another node.


class _ValueDifference(NamedTuple):
    """An object with a different value.

    Attributes:
        entry: index and sub-index of the object.
        wanted: wanted value as bytes on the wire.
        found: present value as bytes on the wire, or None if the node refuses the read.
        why: reason why the node refuses the read.
    """

    entry: Entry
    wanted: bytes
    found: bytes | None
    why: str = ""


def differences(
    session: NetSession, objects: NamedObjects, values: Mapping[Entry, bytes]
) -> Iterator[_ValueDifference]:
    """Read objects of a node, and yield each object whose value differs from the wanted value.

    Objects that cannot be read are also yielded.

    Args:
        session: session with the open bus.
        objects: objects of the node.
        values: wanted value of each object.

    Raises:
        SdoTimeout: the node does not answer.
    """
    for entry, wanted in sorted(values.items()):
        row = objects.rows.get(entry)
        if row is not None and not row.readable:
            yield _ValueDifference(entry, wanted, None, "it cannot be read")
            continue
        try:
            found = session.bus.read(objects.node_id, *entry, objects.size(entry))
        except SdoAborted as error:
            why = failure_text(error, lambda at: "").removeprefix(": ")
            yield _ValueDifference(entry, wanted, None, why)
            continue
        if not same(row, wanted, found):
            yield _ValueDifference(entry, wanted, found)


def difference_text(objects: NamedObjects, one: _ValueDifference, where: str) -> str:
    """Return a difference as text, with the value here and the other value."""
    there = f"{shown(objects, one.entry, one.wanted)} {where}"
    here = one.why if one.found is None else f"{shown(objects, one.entry, one.found)} here"
    return f"{objects.title(one.entry)}: {here}, {there}"
