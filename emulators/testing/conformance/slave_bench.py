"""A slave of anybody on a bus of its own, in virtual time."""

from __future__ import annotations

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.conformance.crash import Crashes, guarded
from tickrig.emulators.testing.conformance.powered_slave import PoweredSlave
from tickrig.emulators.testing.conformance.slave import Slave
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canopen.conform.bus.step_failed import NotAllowed
from tickrig.host.canopen.conform.plan import Stimulus

BOOT_US = 100_000
"""The slave has booted by then."""


class SlaveBench:
    """A slave and the tester on a bus.

    Args:
        slave: what is judged.
        bit_rate: of the bus, 10 000 to 1 000 000 bit/s.
        stimulus: moves its inputs; `power` never reaches it: the supply is switched here.

    Attributes:
        source: where the tester finds it.
    """

    def __init__(self, slave: Slave, bit_rate: int, stimulus: Stimulus | None = None) -> None:
        self._slave, self._stimulus = PoweredSlave(slave), stimulus
        wire = CanWire(bit_rate)
        rig = Rig(Station(self._slave, wire.end()))
        self.source = ConformSource(
            CanHost(rig, wire.end()),
            type(slave).__name__,
            "a bus in virtual time",
            bit_rate,
            virtual=True,
            stimulus=lambda node_id: guarded(self.stimulate),
            watch=lambda node_id, run: crashes.watch(run.crash),
        )
        self._slave.on_crash = crashes = Crashes("your slave")
        rig.run_for(BOOT_US)

    def stimulate(self, *words: str) -> str:
        """Move an input, or switch the supply; NotAllowed if nobody can."""
        if words[0] == "power":
            self._slave.switch(on=words[1] == "on")
            return ""
        if self._stimulus is None:
            raise NotAllowed(f"{' '.join(words)}: nobody moves the inputs of this slave")
        return self._stimulus(*words)
