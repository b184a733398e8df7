"""Changes of the PDOs of a node: allowed changes, scripts that write them, and DCF files.

>>> pdo = PdoDescription(0x190, (0x6000_0108,), relative=False)
>>> pdo = with_entry(pdo, 1, MappedObject(0x6401, 1, 16), insert=True)
>>> [f"{entry:08X}" for entry in pdo.mapping]
['60000108', '64010110']
>>> with_cob_id(pdo, "290h").cob_id == 0x290
True
"""

# Theory of operation
#
# The editor changes a `PdoDescription` on the screen, and `rewrite_pdo` writes it into the node in
# the order of CiA 301:
#
#   1. the PDO is disabled by bit 31, with its old CAN-ID;
#   2. sub-index 0 of the mapping becomes 0;
#   3. the entries, their number and the parameters are written;
#   4. the COB-ID is written without bit 31, which enables the PDO.
#
# Then all values are read back. If the node refuses a step, or keeps another value, the old
# description is written in the same order.
#
# A node may be lost between two steps. Every boot of a node writes the values of its entry in the
# definition. While a rewrite runs, this entry has the old description, so a node that returns gets
# its old mapping (`Rewrite.begin`). After success the entry has the new description: the node gets
# it at each boot, and a saved definition contains it.
#
# Afterwards the node is set up again by the same script as at its boot. Its ports follow from its
# PDOs, so it gets a new proxy. Connections and links are restored, and a node that was Active is
# activated. Many devices accept a mapping in Pre-operational only, so the node enters this state
# first, in the way that its role requires (a drive is switched off before).

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from tickrig.host.canopen.commissioning.configuration import dcf_values, is_parameter
from tickrig.host.canopen.dialogue import Failure, Script
from tickrig.host.canopen.eds import read_sheet, read_sound
from tickrig.host.canopen.errors import SdoAborted, SdoFailed
from tickrig.host.canopen.sdo_transfer import download_number, upload, upload_number
from tickrig.host.rtc.canopen import definition
from tickrig.host.rtc.canopen.boot import set_pdo
from tickrig.host.rtc.canopen.pdo_layout import PARAMETERS
from tickrig.host.rtc.canopen.served_node import NodePhase, ServedNode
from tickrig.host.rtc.states import LifeCycleState
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_writer import write_dcf
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.nmt import CAN_ID_MASK, EXTENDED, INVALID, NmtState, is_restricted
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS, MAX_PDO_BITS, MappedObject, PdoDescription
from tickrig.wire.canopen.sdo_frame import describe_abort

_COB_ID: Final = 1
_TYPE: Final = 2
_INHIBIT: Final = 3
_EVENT: Final = 5
"""Sub-indices of a communication parameter."""

_FLAGS: Final = ~CAN_ID_MASK
_CYCLIC: Final = 240
_ON_REQUEST: Final = (252, 253)
_EVENT_DRIVEN: Final = (254, 255)

_DUMMIES: Final = tuple(
    definition.MappableObject(MappedObject(index, 0, bits), f"dummy: {bits} bits", Access.RPDO)
    for index, bits in ((0x0001, 1), (0x0005, 8), (0x0006, 16), (0x0007, 32))
)
"""Data types that fill up an RPDO (CiA 301, dummy mapping)."""


def mappable(file: definition.DeviceFile, index: int) -> tuple[definition.MappableObject, ...]:
    """Return the objects that can be mapped into a PDO. The dummy objects are last.

    Args:
        file: content of the node's EDS.
        index: index of the PDO's communication parameter.
    """
    way = Access.TPDO if index in definition.TPDOS else Access.RPDO
    return tuple(one for one in (*file.mappable, *_DUMMIES) if way in one.way)


def with_entry(
    pdo: PdoDescription, place: int, entry: MappedObject | None, *, insert: bool = False
) -> PdoDescription:
    """Return a copy of a PDO in which one mapping entry is replaced, inserted or removed.

    Args:
        pdo: PDO to copy.
        place: position of the entry in the mapping, from 0.
        entry: new entry at this position, or None to remove the present entry.
        insert: whether to insert the entry before the present entry, instead of replacing it.

    Raises:
        ValueError: the PDO would have more than 64 bits or 64 entries.
    """
    entries = [*pdo.mapping]
    entries[place : place + (not insert)] = [] if entry is None else [entry.encode()]
    bits = sum(value & 0xFF for value in entries)
    if entry is not None and bits > MAX_PDO_BITS:
        at = f"{entry.index:04X}h:{entry.sub:02X}"
        raise ValueError(
            f"{at} has {entry.bits} bits: the PDO would have {bits} bits, "
            f"at most {MAX_PDO_BITS} are allowed; remove an entry first"
        )
    if len(entries) > MAX_MAPPED_OBJECTS:
        raise ValueError(f"{len(entries)} entries, a PDO has {MAX_MAPPED_OBJECTS} at most")
    return replace(pdo, mapping=tuple(entries))


def with_cob_id(pdo: PdoDescription, words: str) -> PdoDescription:
    """Return a copy of a PDO with the CAN-ID that the user typed, such as `290h`.

    The flags in the COB-ID are kept.

    Raise ValueError if the text is not a CAN-ID that a PDO may have.
    """
    text = words.strip().lower()
    try:
        number = int(text[:-1], 16) if text.endswith("h") else int(text, 0)
    except ValueError:
        raise ValueError(f"{words!r} is not a CAN-ID, as 0x290 or 290h") from None
    if not 0 < number <= CAN_ID_MASK:
        raise ValueError(f"CAN-ID {number:X}h is not in 001h..7FFh")
    if is_restricted(number) or number not in definition.PDO_CAN_IDS:
        ids = definition.PDO_CAN_IDS
        taken = f"CAN-ID {number:03X}h belongs to another service"
        raise ValueError(f"{taken}: PDOs have {ids.start:X}h..{ids.stop - 1:X}h")
    return replace(pdo, cob_id=pdo.cob_id & _FLAGS & 0xFFFF_FFFF | number)


def with_type(pdo: PdoDescription, words: str, *, sends: bool) -> PdoDescription:
    """Return a copy of a PDO with the transmission type that the user typed, such as `255`.

    Raise ValueError if CiA 301 has no such type.

    Args:
        pdo: PDO to copy.
        words: text that the user typed.
        sends: whether the PDO is a TPDO.
    """
    try:
        number = int(words, 0)
    except ValueError:
        raise ValueError(f"{words!r} is not a transmission type, as 1 or 255") from None
    known = number in range(_CYCLIC + 1) or number in _EVENT_DRIVEN
    if not (known or (sends and number in _ON_REQUEST)):
        allowed = "0..240, 252..255" if sends else "0..240, 254, 255"
        raise ValueError(f"transmission type {number} is reserved; allowed: {allowed}")
    return replace(pdo, transmission_type=number)


def switched(pdo: PdoDescription) -> PdoDescription:
    """Return a copy of a PDO that is switched on if it was off, and off if it was on.

    Raise ValueError if the PDO is off and has no CAN-ID.
    """
    if not pdo.enabled and not pdo.can_id:
        raise ValueError("the PDO has no CAN-ID: give it one first")
    return replace(pdo, cob_id=pdo.cob_id ^ INVALID)


# Scripts.


class _PdoRefused(SdoFailed):
    """A PDO that a node did not accept.

    Attributes:
        restored: whether the node has its previous values. If not, the next boot of the node writes
            them.
    """

    def __init__(self, message: str, index: int, sub: int, *, restored: bool) -> None:
        super().__init__(message, index, sub)
        self.restored = restored


Pdos = Mapping[int, PdoDescription]
"""PDOs by communication parameter."""


def read_pdos(file: definition.DeviceFile) -> Script[Pdos]:
    """Script that reads the PDOs of a node, for the PDO editor.

    It leaves out PDOs that cannot be edited: multiplexed PDOs, and PDOs with a 29-bit CAN-ID.
    """
    found = {}
    for index in file.pdos:
        if (pdo := (yield from _read_pdo(index, file))) is not None:
            found[index] = pdo
    return found


def _read_pdo(index: int, file: definition.DeviceFile) -> Script[PdoDescription | None]:
    cob_id = yield from upload_number(index, _COB_ID)
    kind = yield from upload_number(index, _TYPE)
    count = yield from upload_number(index + PARAMETERS, 0)
    if cob_id & EXTENDED or count > MAX_MAPPED_OBJECTS:
        return None
    mapping = []
    for sub in range(1, count + 1):
        mapping.append((yield from upload_number(index + PARAMETERS, sub)))
    inhibit = yield from _optional(index, _INHIBIT, file)
    event = yield from _optional(index, _EVENT, file)
    return PdoDescription(cob_id, tuple(mapping), kind, inhibit, event, relative=False)


def _optional(index: int, sub: int, file: definition.DeviceFile) -> Script[int]:
    if (index, sub) not in file.data_types:
        return 0
    try:
        return (yield from upload_number(index, sub))
    except SdoAborted:
        return 0


def _rewrite_pdos(before: Pdos, wanted: Pdos, file: definition.DeviceFile) -> Script[None]:
    """Write PDOs and read them back. If the node refuses a PDO, restore the old values of all.

    Raises:
        _PdoRefused: the node refused a write, does not answer, or keeps other values.
    """
    begun = list[int]()
    try:
        for index in wanted:
            begun.append(index)
            yield from _write(index, before[index], wanted[index])
            found = yield from _read_pdo(index, file)
            if found != wanted[index]:
                kept = _difference(wanted[index], found)
                raise SdoFailed(f"{index:04X}h: the node keeps {kept}", index, 0)
    except SdoFailed as error:
        why = _why(error)
        try:
            for index in reversed(begun):
                yield from _write(index, wanted[index], before[index])
        except SdoFailed as again:
            text = f"{why}; the old values are written when it boots ({_why(again)})"
            raise _PdoRefused(text, error.index, error.sub, restored=False) from error
        text = f"{why}; the old values are back"
        raise _PdoRefused(text, error.index, error.sub, restored=True) from error


def _why(error: SdoFailed) -> str:
    if isinstance(error, SdoAborted):
        return f"{error.index:04X}h:{error.sub:02X} refused: {describe_abort(error.code)}"
    return str(error)


def _write(index: int, there: PdoDescription, wanted: PdoDescription) -> Script[None]:
    """Write the differences. A CAN-ID must not change while the PDO is on, so it is off first."""
    yield from download_number(index, _COB_ID, there.cob_id | INVALID, 4)
    yield from set_pdo(index, _changes(there, wanted))


def _changes(there: PdoDescription, wanted: PdoDescription) -> definition.PdoEntry:
    """Return the parameters for `set_pdo`. The mapping is always included.

    A failed step may have cut the mapping in the node.
    """
    kind, inhibit, event = wanted.transmission_type, wanted.inhibit_100us, wanted.event_ms
    return definition.PdoEntry(
        tuple(map(MappedObject.parse, wanted.mapping)),
        wanted.cob_id,
        None if kind == there.transmission_type else kind,
        None if inhibit == there.inhibit_100us else inhibit,
        None if event == there.event_ms else event,
    )


def _difference(wanted: PdoDescription, found: PdoDescription | None) -> str:
    """Return the difference between the values of a node and the written values."""
    if found is None:
        return "a multiplexed PDO"
    if found.mapping != wanted.mapping:
        entries = " ".join(f"{value:08X}h" for value in found.mapping) or "none"
        return f"the mapping {entries}"
    if found.cob_id != wanted.cob_id:
        return f"the COB-ID {found.cob_id:08X}h"
    return (
        f"transmission type {found.transmission_type}, inhibit time {found.inhibit_100us}, "
        f"event timer {found.event_ms}"
    )


def pdo_name(node_id: int, index: int) -> definition.PdoName:
    """Return the name of a PDO from the index of its communication parameter."""
    kind = "t" if index in definition.TPDOS else "r"
    return definition.PdoName(node_id, f"{kind}pdo{(index & 0x1FF) + 1}")


class Rewrite:
    """Task that writes changed PDOs into a node and then sets up the node again.

    Args:
        node: node to change.
        before: PDOs that the node has.
        wanted: new descriptions of those PDOs that change.
        linked: PDOs that are linked with a TPDO of another node. Their CAN-ID is that of the TPDO,
            so it cannot be changed.

    Raises:
        ServerRefused: the node does not answer SDO requests now, or the CAN-ID of a linked PDO
            would change.
    """

    def __init__(
        self, node: ServedNode, before: Pdos, wanted: Pdos, linked: Collection[int]
    ) -> None:
        check_answers(node)
        for index in linked:
            if wanted[index].cob_id != before[index].cob_id:
                name = pdo_name(node.entry.id, index)
                raise definition.ServerRefused(
                    f"{name} is linked: cut the link to change its COB-ID"
                )
        self._node, self._before, self._wanted, self._linked = node, before, wanted, linked
        self._pdos = node.entry.pdos
        proxy = node.proxy
        self._was_active = proxy is not None and proxy.state is LifeCycleState.ACTIVE

    def begin(self) -> Script[None]:
        """Return the script that writes the changed PDOs.

        If the node is lost during the script, it gets the old values at its next boot.
        """
        self._keep(self._wanted, self._before)
        return self._script()

    def done(self) -> None:
        """Set up the node with the new values, now and at each later boot."""
        self._keep(self._before, self._wanted)
        self._boot()

    def failed(self, failure: Failure | str) -> None:
        """Set up the node with its previous values."""
        if not isinstance(failure, _PdoRefused) or failure.restored:
            self._node.entry = replace(self._node.entry, pdos=self._pdos)
        self._boot()

    def _script(self) -> Script[None]:
        if self._node.nmt_state is NmtState.OPERATIONAL:
            yield from self._node.operations.leave_operational()
        yield from _rewrite_pdos(self._before, self._wanted, self._node.file)

    def _keep(self, there: Pdos, values: Pdos) -> None:
        """Make each boot of the node write these values in place of other values."""
        pdos = {**self._pdos}
        for index in self._wanted:
            name = pdo_name(self._node.entry.id, index).pdo
            pdos[name] = self._entry(name, index, _changes(there[index], values[index]))
        self._node.entry = replace(self._node.entry, pdos=pdos)

    def _entry(self, name: str, index: int, new: definition.PdoEntry) -> definition.PdoEntry:
        """Return an entry with its changes. A linked PDO keeps its own CAN-ID."""
        old = self._pdos.get(name, definition.PdoEntry())
        return definition.PdoEntry(
            new.mapping,
            old.cob_id if index in self._linked else new.cob_id,
            old.type if new.type is None else new.type,
            old.inhibit_100us if new.inhibit_100us is None else new.inhibit_100us,
            old.event_ms if new.event_ms is None else new.event_ms,
        )

    def _boot(self) -> None:
        self._node.to_start |= self._was_active
        self._node.boot(self._node.operations.now_us)


def check_answers(node: ServedNode) -> None:
    """Raise ServerRefused if a node does not answer SDO requests now."""
    if node.phase is not NodePhase.READY or node.lost:
        raise definition.ServerRefused(f"node {node.entry.id} is not ready")
    if node.nmt_state is NmtState.STOPPED:
        raise definition.ServerRefused(f"node {node.entry.id} is Stopped: reset it first")


# DCF files.


class _Table:
    """The objects of a device in the form that `write_dcf` needs."""

    def __init__(self, device: EdsDevice) -> None:
        self._device = device
        self.objects = dict(sorted(device.objects.items()))

    def __iter__(self) -> Iterator[EntryDescription]:
        return iter(sorted(self._device.entries, key=lambda row: row.key))


def read_parameters(path: Path) -> Script[Mapping[int, bytes]]:
    """Script that reads from a node all values for its DCF: the writable parameters in the EDS.

    Raises:
        OSError: the EDS cannot be read.
        EdsError: the EDS has no usable object.
    """
    values = {}
    for row in read_sound(path)[0].entries:
        if is_parameter(row):
            with suppress(SdoAborted):  # an object that this node does without
                values[row.key] = yield from upload(row.index, row.sub, row.size)
    return values


def save_dcf(
    path: Path, eds: Path, node_id: int, bit_rate: int, values: Mapping[int, bytes]
) -> None:
    """Save the values read from a node as a DCF. If that fails, an existing file is kept unchanged.

    Args:
        path: path of the DCF.
        eds: path of the node's EDS.
        node_id: node-ID of the node, 1..127.
        bit_rate: bit rate in bit/s.
        values: values read from the node. The key is index << 8 | sub-index.

    Raises:
        OSError: a file cannot be read or written.
        ValueError: the EDS cannot be used.
    """
    device = read_sound(eds)[0]
    write_whole(path, write_dcf(_Table(device), node_id, bit_rate, values, device.info))


def pdos_of_dcf(path: Path, node_id: int, file: definition.DeviceFile, there: Pdos) -> Pdos:
    """Return those PDOs in a DCF that differ from the present PDOs of a node.

    Args:
        path: path of the DCF.
        node_id: node-ID of the node.
        file: content of the node's EDS.
        there: PDOs that the node has.

    Raises:
        OSError: the DCF cannot be read.
        ValueError: the DCF belongs to another device, or has no values.
    """
    sheet, device = read_sheet(path)
    values = dcf_values(sheet, device, node_id)
    if not values:
        raise ValueError(f"{path}: no ParameterValue of an object that can be written: no DCF")
    given = {
        (row.index, row.sub): int.from_bytes(row.default, "little")
        for row in device.entries
        if row.has_default and row.data_type.is_integer
    }
    for at, number in file.identity.items():
        if at in given and given[at] != number:
            where = f"{at[0]:04X}h:{at[1]:02X}"
            found = f"{where} is {given[at]:08X}h, not {number:08X}h"
            raise ValueError(f"{path}: a DCF of another device: {found}")
    wanted = {index: _of_values(index, pdo, values) for index, pdo in there.items()}
    for index, pdo in wanted.items():
        if (bits := sum(value & 0xFF for value in pdo.mapping)) > MAX_PDO_BITS:
            raise ValueError(f"{path}: {index:04X}h has {bits} bits, a PDO has {MAX_PDO_BITS}")
    return {index: pdo for index, pdo in wanted.items() if pdo != there[index]}


def _of_values(
    index: int, pdo: PdoDescription, values: Mapping[tuple[int, int], bytes]
) -> PdoDescription:
    def number(at: tuple[int, int], there: int) -> int:
        return int.from_bytes(values[at], "little") if at in values else there

    count = number((index + PARAMETERS, 0), len(pdo.mapping))
    entries = (*pdo.mapping, *(0 for _ in range(MAX_MAPPED_OBJECTS)))
    return PdoDescription(
        number((index, _COB_ID), pdo.cob_id),
        tuple(
            number((index + PARAMETERS, sub), entries[sub - 1])
            for sub in range(1, min(count, MAX_MAPPED_OBJECTS) + 1)
        ),
        number((index, _TYPE), pdo.transmission_type),
        number((index, _INHIBIT), pdo.inhibit_100us),
        number((index, _EVENT), pdo.event_ms),
        relative=False,
    )
