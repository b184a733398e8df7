"""R1 in three stacks: ours, LocalNode of the canopen library, durand."""

from __future__ import annotations

from pathlib import Path

import canopen
from durand import Node
from durand.network import NetworkABC
from durand.node import NodeCapabilities

from tests.device.canopen.reference import NODE_ID, make_dictionary
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.testing.conformance.foreign.durand_slave import DurandSlave
from tickrig.emulators.testing.conformance.foreign.local_node import LocalNodeSlave

R1_EDS = Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds"


def ours() -> CanopenSlave:
    return make_slave(make_dictionary(), NODE_ID)


def local_node() -> LocalNodeSlave:
    return LocalNodeSlave(lambda: canopen.LocalNode(NODE_ID, str(R1_EDS)))


def durand() -> DurandSlave:
    def make(network: NetworkABC) -> Node:
        return Node(network, NODE_ID, capabilities=NodeCapabilities(2, 4, 4))

    return DurandSlave(make)
