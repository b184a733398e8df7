"""Any slave of ours on a bus in virtual time, under the tester."""

from __future__ import annotations

from pathlib import Path

from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import describe
from tickrig.emulators.canopen.eds import EdsCache
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canopen.conform.binding.capabilities import NodeDescription
from tickrig.host.canopen.conform.check import ConformancePlan
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report
from tickrig.host.canopen.eds import open_eds

HARMLESS = {CheckVerdict.PASS, CheckVerdict.NOT_APPLICABLE, CheckVerdict.IMPLEMENTATION_DEFINED}


class Judged:
    """A slave that has booted, and the host's end of its bus."""

    def __init__(self, slave: CanopenSlave, *others: CanopenSlave) -> None:
        self.slave, self.wire = slave, CanWire()
        self.rig = Rig(*(Station(each, self.wire.end()) for each in (slave, *others)))
        self.link = CanHost(self.rig, self.wire.end())
        self.rig.run_for(100_000)

    @classmethod
    def of(cls, device: Path | str, *others: CanopenSlave) -> Judged:
        """Make a model by its name, or a device of its EDS."""
        return cls(slave_of(device), *others)

    def values(self) -> dict[tuple[int, int], bytes]:
        """Return what all its objects hold."""
        return {(e.index, e.sub): e.data for e in self.slave.dictionary}

    def judge(self, plan: ConformancePlan, eds: Path | None = None) -> Report:
        """Run the tester."""
        known = NodeDescription.of_file(open_eds(eds)) if eds else None
        device, claims = (known.device, known.claims) if known else (None, None)
        return ConformRun(self.link, self.slave.node_id, plan, device=device, claims=claims).run()


def slave_of(device: Path | str) -> CanopenSlave:
    """Make a slave of a model, or of an EDS."""
    described = describe(EdsCache(), device)
    node_id = described.node_id or 5
    dictionary = described.make_dictionary()
    return make_slave(dictionary, node_id, application=described.application)


def not_harmless(report: Report) -> list[str]:
    """Return what failed, or could not be judged, one a line."""
    return [
        f"{result.check.id} {result.outcome.verdict}: {result.outcome.reason}"
        for result in report.results
        if result.outcome.verdict not in HARMLESS
    ]
