"""R1, the reference slave, on a rig in virtual time, under the tester."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from tests.device.canopen.profile_objects import make_dictionary
from tests.device.canopen.reference import NODE_ID
from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.verdict import Report
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import read_device

EDS: Final = Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds"


class R1:
    """R1 and its bus.

    Attributes:
        link: the host's end of the bus.
    """

    def __init__(
        self, needs: Iterable[str] = (), application: type[Application] = Application
    ) -> None:
        dictionary = make_dictionary(frozenset(needs))
        self.slave: CanopenSlave = make_slave(dictionary, NODE_ID, application=application)
        self.wire = CanWire()
        self.rig = Rig(Station(self.slave, self.wire.end()))
        self.link = CanHost(self.rig, self.wire.end())
        self.rig.run_for(100_000)

    def values(self) -> dict[tuple[int, int], bytes]:
        """Return what all its objects hold."""
        return {(e.index, e.sub): e.data for e in self.slave.dictionary}

    def judge(self, plan: Plan, **given: Any) -> Report:
        """Run the tester against it."""
        file = open_eds(EDS)
        device = read_device(file)
        return ConformRun(self.link, NODE_ID, plan, device=device, eds=file, **given).run()


def yes(question: str) -> bool:
    return True
