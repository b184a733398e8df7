"""R1 in three stacks: ours, LocalNode of the canopen library, durand; each with its EDS.

The objects of R1 are those that the stack has something for: an EDS that promises heartbeat
consumers of a stack without any would say nothing of the stack.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import canopen
from durand import DatatypeEnum, Node, Record, Variable
from durand.network import NetworkABC
from durand.node import NodeCapabilities

from tests.device.canopen.reference import NODE_ID, make_dictionary
from tests.environment import ROOT
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.testing.conformance.conformance import conformance
from tickrig.emulators.testing.conformance.durand_slave import DurandSlave
from tickrig.emulators.testing.conformance.local_node import LocalNodeSlave
from tickrig.host.canopen.conform.bus.exchange import NotAllowed
from tickrig.host.canopen.conform.verdict import Report
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

R1_EDS: Final = ROOT / "tests" / "golden" / "canopen" / "r1.eds"
HISTORY, GUARDING, STORE, CONSUMER = (0x1003,), (0x100C, 0x100D), (0x1010, 0x1011), (0x1016,)
SYNC_PRODUCER, TIME, SDO_2, BITS = (0x1006, 0x1007, 0x1019), (0x1012,), (0x1201,), (0x200C,)
NOT_IN_BOTH: Final = (
    *(*HISTORY, *GUARDING, *STORE, *CONSUMER, *SYNC_PRODUCER, *TIME, *BITS, 0x1029, 0x1F80),
)
"""Objects for which neither stack has anything."""
PDO_SUBS: Final = (5, 6)
"""Event timer and SYNC start value, which neither has."""
PDOS: Final = (*range(0x1400, 0x1600), *range(0x1800, 0x1A00))
OWN_OF_DURAND: Final = range(0x1000, 0x2000)


class Stack(NamedTuple):
    """A stack that can be judged.

    Attributes:
        name: of it, with its version.
        judge: judges it, as `conformance` does.
    """

    name: str
    judge: Callable[[tuple[str, ...]], Report]


def eds(leave_out: tuple[int, ...] = (), lss: bool = True) -> EdsFile:
    """Return the EDS of R1 without some objects."""
    return EdsFile("r1.eds", _text(leave_out, lss))


def _text(leave_out: tuple[int, ...], lss: bool) -> str:
    def kept(entry: EntryDescription) -> bool:
        of_pdo = bool(leave_out) and entry.index in PDOS and entry.sub in PDO_SUBS
        return entry.index not in leave_out and not of_pdo

    made = make_dictionary()
    entries = list(filter(kept, made.description))
    text = write_eds(Dictionary(entries, made.objects).description)
    if leave_out:
        text = re.sub(r"^(Dummy\d{4})=1", r"\1=0", text, flags=re.MULTILINE)
    return text if lss else text.replace("LSS_Supported=1", "LSS_Supported=0")


def ours() -> CanopenSlave:
    return make_slave(make_dictionary(), NODE_ID)


OF_LOCAL_NODE: Final = (*NOT_IN_BOTH, *SDO_2)


def local_node() -> LocalNodeSlave:
    text = _text(OF_LOCAL_NODE, lss=False)

    def make() -> canopen.LocalNode:
        file = io.StringIO(text)
        file.name = "r1.eds"
        return canopen.LocalNode(NODE_ID, file)  # type: ignore[arg-type]  # a file will do

    return LocalNodeSlave(make)


def durand() -> DurandSlave:
    slave = DurandSlave(lambda network: _durand_node(network, slave_id[0]))
    slave_id = [NODE_ID]
    slave.node_ids = slave_id  # type: ignore[attr-defined]  # its switches
    return slave


def _durand_node(network: NetworkABC, node_id: int) -> Node:
    """Make a node with the objects of R1 that it does not make itself."""
    node = Node(network, node_id, capabilities=NodeCapabilities(2, 4, 4))
    od = node.object_dictionary
    for index, entries in _by_index(make_dictionary()):
        if index in OWN_OF_DURAND:
            for entry in entries:
                _set_value(od, entry)
        elif len(entries) == 1 and not entries[0].sub:
            od[index] = _variable(entries[0])
        else:
            od[index] = Record(name=entries[0].name)
            for entry in entries[1:]:
                od[index][entry.sub] = _variable(entry)
    for number, pdos in enumerate(zip(node.tpdo, node.rpdo, strict=True)):
        for pdo, first in zip(pdos, (0x1A00, 0x1600), strict=True):
            pdo.mapping = _mapped(first + number)
    return node


def _by_index(dictionary: Dictionary) -> Iterator[tuple[int, list[EntryDescription]]]:
    objects: dict[int, list[EntryDescription]] = {}
    for entry in dictionary.description:
        objects.setdefault(entry.index, []).append(entry)
    yield from objects.items()


def _set_value(od: object, entry: EntryDescription) -> None:
    """Give an object of durand's own the value of R1, where that is a constant."""
    constant = entry.index in (0x1000, 0x1008, 0x1009) or (entry.index == 0x1018 and entry.sub)
    if constant:
        variable = od.lookup(entry.index, entry.sub)  # type: ignore[attr-defined]  # no types
        variable.value = _value(entry)


def _variable(entry: EntryDescription) -> Variable:
    access = {3: "rw", 1: "ro", 2: "wo"}[
        bool(entry.access & Access.READ) + 2 * bool(entry.access & Access.WRITE)
    ]
    kind, limits = DatatypeEnum(int(entry.data_type)), {}
    if entry.low is not None:
        limits = {"minimum": entry.low, "maximum": entry.high}
    return Variable(kind, access, _value(entry), name=entry.name, **limits)


def _value(entry: EntryDescription) -> object:
    value = entry.data_type.decode(entry.default)
    return value.encode() if isinstance(value, str) else value


def _mapped(index: int) -> list[tuple[int, int]]:
    dictionary = make_dictionary()
    count = dictionary[index, 0].data[0]
    words = [int.from_bytes(dictionary[index, sub].data, "little") for sub in range(1, count + 1)]
    return [(word >> 16, word >> 8 & 0xFF) for word in words]


class LocalNodeStimulus:
    """What an application of LocalNode does."""

    def __init__(self, slave: LocalNodeSlave) -> None:
        self._slave = slave

    def __call__(self, *words: str) -> str:
        node = self._slave.node
        match words:
            case ("input", name, data) if ":" in name:
                index, _, sub = name.partition(":")
                node.set_data(int(index, 16), int(sub, 16), bytes.fromhex(data))
            case ("emergency", code, register):
                node.emcy.send(int(code, 16), int(register, 16))
            case ("emergency-clear", _):
                node.emcy.reset()
            case _:
                raise NotAllowed(f"{' '.join(words)}: LocalNode has nothing of the kind")
        return ""


class DurandStimulus:
    """What an application of durand does."""

    def __init__(self, slave: DurandSlave) -> None:
        self._slave = slave

    def __call__(self, *words: str) -> str:
        match words:
            case ("input", name, data) if ":" in name:
                index, _, sub = name.partition(":")
                self._write(int(index, 16), int(sub, 16), bytes.fromhex(data))
            case ("emergency", code, register):
                self._slave.act(lambda node: node.emcy.set(int(code, 16), int(register, 16)))
            case ("emergency-clear", _):
                self._slave.act(lambda node: node.emcy.set(0, 0))
            case ("node-id", node_id):
                self._slave.node_ids[0] = int(node_id, 16)  # type: ignore[attr-defined]
            case _:
                raise NotAllowed(f"{' '.join(words)}: durand has nothing of the kind")
        return ""

    def _write(self, index: int, sub: int, data: bytes) -> None:
        def write(node: Node) -> None:
            variable = node.object_dictionary.lookup(index, sub)
            node.object_dictionary.write(index, sub, variable.unpack(data))

        self._slave.act(write)


def judge_ours(only: tuple[str, ...] = ()) -> Report:
    return conformance(ours(), only=only, allow=range(0x6000, 0xA000))


def judge_local_node(only: tuple[str, ...] = ()) -> Report:
    slave = local_node()
    return conformance(
        slave,
        node_id=NODE_ID,
        eds=eds(OF_LOCAL_NODE, lss=False),
        only=only,
        allow=range(0x6000, 0xA000),
        stimulus=LocalNodeStimulus(slave),
    )


def judge_durand(only: tuple[str, ...] = ()) -> Report:
    slave = durand()
    return conformance(
        slave,
        node_id=NODE_ID,
        eds=eds(NOT_IN_BOTH),
        only=only,
        allow=range(0x6000, 0xA000),
        stimulus=DurandStimulus(slave),
    )
