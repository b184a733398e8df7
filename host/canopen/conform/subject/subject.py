"""The node under test: what it has, and what it says of itself."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.conform.binding.binding import Binding, bind
from tickrig.host.canopen.conform.binding.capabilities import Features, find_features
from tickrig.host.canopen.conform.bus.sdo_client import SdoClient, SizeOf
from tickrig.host.canopen.conform.check import Level, Step
from tickrig.host.canopen.conform.notation.bound_check import BoundCheck
from tickrig.host.canopen.conform.notation.macro_words import MAP, written_by
from tickrig.host.canopen.conform.notation.names import Address
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.safety.permission import MANUFACTURER, PROFILE, PROGRAMS, STORAGE
from tickrig.host.canopen.conform.subject.node_names import NodeNames
from tickrig.host.canopen.errors import SdoFailed
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.eds.standard_objects import standard_object

TEXTS: Final = {0x1008: "name", 0x1009: "hardware version", 0x100A: "software version"}
IDENTITY: Final = ("vendor", "product", "revision", "serial")
MANDATORY: Final = {(0x1000, 0): "UE-01", (0x1001, 0): "UE-02", (0x1018, 0): "UE-05"}
"""Objects of each node, and the check that fails where one is not there."""
INDICES: Final = {index for index, _ in MANDATORY}
COMMUNICATION: Final = 0x1000
READ_ONLY: Final = "06010002"


@dataclass(frozen=True, slots=True)
class Subject:
    """What was found out about the node before the first check.

    Attributes:
        binding: its objects by name.
        features: what it can do.
        names: what stands for names in checks.
        about: what it says of itself, by name, for people.
        has: its objects by index and sub-index; made once, a tenth of a run.
        values: those that can be read and written.
        refused: the mandatory objects that the node does not let be read.
    """

    binding: Binding
    features: Features
    names: NodeNames
    about: dict[str, str]
    has: frozenset[Address]
    values: frozenset[Address]
    refused: frozenset[Address]

    def missing(self, bound: BoundCheck) -> str | None:
        """Return why not all that a check uses can be used: what is not there; None if all is.

        Where the node lacks a mandatory object, one check fails, and others do not use it.
        """
        for at in sorted(bound.written & self.refused | bound.used):
            judge, where = MANDATORY.get(at, ""), f"{at[0]:04X}h:{at[1]:02X}"
            if at in self.refused and judge != bound.check.id:
                return f"the node has no {where}: {judge}"
            if at not in self.has and at[0] not in INDICES:
                return f"{self._where(at[0])} {where}"
        return None

    def fixed(self, steps: Collection[Step]) -> str | None:
        """Return why not all that is written takes its value: CiA 301 lets it be constant.

        None if all does.
        """
        for step in steps:
            for at in _takes(step):
                entry = self.entries.get(at)
                if entry is not None and not entry.writable:
                    return f"{at[0]:04X}h:{at[1]:02X} is read-only"
            entry = self.entries.get(step.get("write", (0, 0)))
            if entry is not None and not _within(entry, bytes.fromhex(step["data"])):
                at = step["write"]
                return f"{at[0]:04X}h:{at[1]:02X} takes only {entry.low} to {entry.high}"
        return None

    @property
    def entries(self) -> Mapping[Address, EntryDescription]:
        """The descriptions of its objects."""
        return self.binding.entries

    def _where(self, index: int) -> str:
        """Say who has no such object: without an EDS only those of CiA 301 were asked for."""
        if self.binding.known:
            return "the EDS has no"
        asked = COMMUNICATION <= index < MANUFACTURER
        return "the node has no" if asked else "without an EDS nobody knows of any"

    def restorable(self, level: Level) -> Iterator[Address]:
        """Yield objects that a run may change, be it by a reset: read before, written after."""
        highest = PROFILE if level is Level.INTRUSIVE else MANUFACTURER
        for entry in self.binding.device.entries:
            inside = COMMUNICATION <= entry.index < highest and entry.index not in PROGRAMS
            value = entry.data_type is not DataType.DOMAIN and entry.index not in STORAGE
            if inside and value and entry.readable and entry.writable:
                yield entry.index, entry.sub


def _takes(step: Step) -> Iterator[Address]:
    """Yield what a step writes, and the node shall take, or refuse for what it is."""
    if "write" in step:
        yield step["write"]
    if "refuse write" in step and READ_ONLY not in step["codes"]:  # another reason is asked for
        yield step["refuse write"]
    if step.get("macro", [""])[0] == MAP:
        yield from written_by(*step["macro"])


def _within(entry: EntryDescription, data: bytes) -> bool:
    """Return whether a value lies within the limits of an object, where it has any."""
    if not entry.data_type.is_integer or len(data) != entry.size:
        return True
    value = int.from_bytes(data, "little", signed=entry.signed)
    return (entry.low is None or value >= entry.low) and (entry.high is None or value <= entry.high)


def examine(  # noqa: PLR0913, PLR0917 - all that is known
    client: SdoClient,
    node_id: int,
    plan: Plan,
    device: EdsDevice | None,
    eds: EdsFile | None,
    others: Collection[int],
) -> Subject:
    """Find out what a node has; it is only read.

    Raises:
        SdoTimeout: it does not answer.
    """
    client.size_of = _standard_size if device is None else _sizes(device)
    binding = bind(device, client.upload, allow=plan.allow, never=plan.never)
    features = find_features(binding, client, eds)
    names = NodeNames(node_id, binding, client.number, others)
    entries = binding.device.entries
    has = frozenset((entry.index, entry.sub) for entry in entries)
    values = frozenset((e.index, e.sub) for e in entries if e.readable and e.writable)
    refused = frozenset(at for at in MANDATORY if client.number(*at) is None)
    return Subject(binding, features, names, dict(_about(client)), has, values, refused)


def _sizes(device: EdsDevice) -> SizeOf:
    """Take the sizes of the EDS; those of texts from their defaults."""
    sizes = {(entry.index, entry.sub): len(entry.default) for entry in device.entries}
    return lambda index, sub: sizes.get((index, sub), 0)


def _standard_size(index: int, sub: int) -> int:
    known = standard_object(index)
    kind = known and known.types.get(sub, known.others)
    return kind.size if kind else 0


def _about(client: SdoClient) -> Iterator[tuple[str, str]]:
    device_type = client.number(0x1000, 0)
    if device_type is not None:
        yield "device type", f"{device_type:08X}h"
    for index, name in TEXTS.items():
        try:
            text = client.upload(index, 0).decode("latin-1")
        except SdoFailed:
            continue
        yield name, "".join(c for c in text if c.isprintable())
    for sub, name in enumerate(IDENTITY, 1):
        number = client.number(0x1018, sub)
        if number is not None:
            yield name, f"{number:08X}h"
