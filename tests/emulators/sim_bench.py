"""A canopen master on a rig with our slaves."""

from __future__ import annotations

import io
from typing import Any

import canopen
from canopen.profiles.p402 import BaseNode402

from tests.device.canopen.profile_objects import DRIVE, make_dictionary
from tests.emulators.can.can_bench import Log
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.slave import Application
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

NODE_ID = 5


def dictionary(*needs: str) -> Dictionary:
    """Make that of the reference slave, with what the library wants to know of a drive."""
    made = make_dictionary(needs)
    modes = EntryDescription(
        0x6502, 0, "Supported drive modes", DataType.UNSIGNED32, Access.READ, default=0x1FF
    )
    return Dictionary([*made.description, modes], made.objects)


def eds(*needs: str) -> io.StringIO:
    """Return the EDS of the reference slave, as the library wants a file."""
    file = io.StringIO(write_eds(dictionary(*needs).description))
    file.name = "reference.eds"
    return file


class SimBench:
    """One slave, and the library's network."""

    def __init__(self, *needs: str, node_id: int = NODE_ID) -> None:
        self.wire = CanWire()
        self.log = Log(self.wire)
        application = Ds402 if DRIVE in needs else Application
        self.slave = make_slave(dictionary(*needs), node_id, application=application)
        self.end = self.wire.end()
        self.rig = Rig(Station(self.slave, self.end))
        self.network = SimNetwork(self.rig, self.wire.end())
        self.needs = needs

    def master(self) -> canopen.RemoteNode:
        """Add the slave to the network."""
        return self.network.add_node(canopen.RemoteNode(NODE_ID, eds(*self.needs)))

    def drive(self) -> Any:  # the library does not annotate its drives
        """Add the slave to the network as a drive."""
        kind: Any = BaseNode402
        return self.network.add_node(kind(NODE_ID, eds(*self.needs)))
