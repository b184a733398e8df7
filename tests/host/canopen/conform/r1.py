"""R1, the reference slave, on a rig in virtual time, under the tester."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from tests.device.canopen.actions import SlaveActions
from tests.device.canopen.profile_objects import make_dictionary
from tests.device.canopen.reference import NODE_ID
from tickrig.device.canopen.dictionary import SdoAbort
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.slave import Application, CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.conformance.conformance import PoweredSlave
from tickrig.host.canopen.conform.binding.capabilities import EdsClaims
from tickrig.host.canopen.conform.check import ConformancePlan
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.verdict import Report
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.errors import WireError

EDS: Final = Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds"


HISTORY: Final = 0x1003


class Stimulus:
    """The hands at the inputs of R1, in the words of the tester."""

    WORDS: Final = {"emergency": "emcy", "emergency-clear": "emcy_clear", "node-id": "nodeid"}

    def __init__(self, r1: R1, actions: SlaveActions) -> None:
        self._r1, self._actions = r1, actions

    def __call__(self, verb: str, *words: str) -> str:
        try:
            return self._act(verb, *words)
        except (AssertionError, StopIteration, KeyError, SdoAbort, WireError) as error:
            raise ValueError(str(error)) from error

    def _act(self, verb: str, *words: str) -> str:
        match verb, *words:
            case "power", "off":
                self._r1.power(on=False)
            case "power", "on":
                self._r1.power(on=True)
            case "input", name, value if ":" in name:
                index, _, sub = name.partition(":")
                self._actions.act("od", index, sub, value)
            case "input", name, value:
                self._actions.act(name[:2], name[2:], value)
            case "output", name:
                return self._output(name)
            case _:
                self._actions.act(self.WORDS.get(verb, verb), *words)
        return ""

    def _output(self, name: str) -> str:
        slave = self._r1.slave
        if name == "time":
            time = slave.time_of_day
            return "none" if time is None else f"{time.ms}.{time.days}"
        module = Ds401.of(slave)
        if name.startswith("ao"):
            return str(module.read(name))
        return f"{int(module.read('do')) >> 8 * (int(name[2:]) - 1) & 0xFF:02X}"


class R1:
    """R1 and its bus.

    Attributes:
        link: the host's end of the bus.
    """

    def __init__(
        self,
        needs: Iterable[str] = (),
        application: type[Application] = Application,
        device_type: int = 0x000F_0191,
    ) -> None:
        dictionary = make_dictionary(frozenset(needs))
        self.slave: CanopenSlave = make_slave(dictionary, NODE_ID, application=application)
        self.wire = CanWire()
        self.powered = PoweredSlave(self.slave)
        self.rig = Rig(Station(self.powered, self.wire.end()))
        self.link = CanHost(self.rig, self.wire.end())
        self.rig.run_for(100_000)
        dictionary[0x1000, 0].assign(device_type.to_bytes(4, "little"))

    def power(self, *, on: bool) -> None:
        self.powered.switch(on=on)

    def values(self) -> dict[tuple[int, int], bytes]:
        """Return what all its objects hold."""
        return {
            (e.index, e.sub): e.data
            for e in self.slave.dictionary
            if e.index != HISTORY or not e.sub  # beyond 1003h:00 nothing can be read
        }

    def judge(self, plan: ConformancePlan, **given: Any) -> Report:
        """Run the tester against it."""
        link = given.pop("link", self.link)
        file = open_eds(EDS)
        claims = EdsClaims.of_file(file)
        dictionary = self.slave.dictionary
        entries = tuple(entry.description for entry in dictionary)
        device = EdsDevice(read_device(file).info, entries, dictionary.objects)
        return ConformRun(link, NODE_ID, plan, device=device, claims=claims, **given).run()


def yes(question: str) -> bool:
    return True
