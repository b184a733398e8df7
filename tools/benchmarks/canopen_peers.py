"""The same slave in three stacks: ours, python-canopen's LocalNode, durand."""

from __future__ import annotations

from collections.abc import Callable

import canopen
from canopen.objectdictionary import ODVariable
from durand import DatatypeEnum, Node, Variable
from durand.network import NetworkABC

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import TICK_US
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

NODE_ID = 5
REQUEST, REPLY = 0x600 + NODE_ID, 0x580 + NODE_ID
RW = Access.READ | Access.WRITE

Peer = Callable[[bytes], list[bytes]]
"""Takes an SDO request, gives what was answered."""


def our_slave() -> Peer:
    """Our slave, ticked once for each request."""
    entries = [
        EntryDescription(0x1000, 0, "Device type", DataType.UNSIGNED32, Access.READ, default=0x191),
        EntryDescription(0x1200, 0, "Highest", DataType.UNSIGNED8, Access.READ, default=2),
        EntryDescription(
            0x1200, 1, "Client", DataType.UNSIGNED32, Access.READ, default=0x600, relative=True
        ),
        EntryDescription(
            0x1200, 2, "Server", DataType.UNSIGNED32, Access.READ, default=0x580, relative=True
        ),
        EntryDescription(0x2002, 0, "u32", DataType.UNSIGNED32, RW, default=1),
        EntryDescription(0x2008, 0, "domain", DataType.DOMAIN, RW),
    ]
    slave = make_slave(Dictionary(entries), NODE_ID)
    now_us = TICK_US
    slave.tick(now_us, ())

    def ask(request: bytes) -> list[bytes]:
        nonlocal now_us
        now_us += TICK_US
        return [frame.data for frame in slave.tick(now_us, (CanFrame(REQUEST, request),))]

    return ask


def local_node() -> Peer:
    """LocalNode of the canopen library, called as its network would."""
    dictionary = canopen.ObjectDictionary()
    for index, data_type in ((0x1000, 7), (0x2002, 7), (0x2008, 0xF)):
        variable = ODVariable(f"v{index:X}", index)
        variable.data_type, variable.default = data_type, b"" if data_type == 0xF else 1
        dictionary.add_object(variable)
    node, network = canopen.LocalNode(NODE_ID, dictionary), canopen.Network()
    answers: list[bytes] = []
    network.send_message = lambda can_id, data, remote=False: answers.append(bytes(data))
    network.add_node(node)
    answers.clear()

    def ask(request: bytes) -> list[bytes]:
        node.sdo.on_request(REQUEST, bytearray(request), 0.0)
        taken = answers[:]
        answers.clear()
        return taken

    return ask


class _DurandNetwork(NetworkABC):
    def __init__(self) -> None:
        self.subscriptions: dict[int, Callable[[int, bytes], None]] = {}
        self.sent: list[bytes] = []

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        self.subscriptions[cob_id] = callback

    def remove_subscription(self, cob_id: int) -> None:
        self.subscriptions.pop(cob_id, None)

    def send(self, cob_id: int, msg: bytes) -> None:
        self.sent.append(bytes(msg))


def durand_node() -> Peer:
    """A durand node on a network that only calls back."""
    network = _DurandNetwork()
    node = Node(network, NODE_ID)
    node.object_dictionary[0x2002] = Variable(DatatypeEnum.UNSIGNED32, "rw", 1)
    node.object_dictionary[0x2008] = Variable(DatatypeEnum.DOMAIN, "rw", b"")
    network.sent.clear()

    def ask(request: bytes) -> list[bytes]:
        network.subscriptions[REQUEST](REQUEST, request)
        taken = network.sent[:]
        network.sent.clear()
        return taken

    return ask


PEERS = {"tickrig": our_slave, "python-canopen LocalNode": local_node, "durand": durand_node}
