"""Where the demonstration is played: two devices on ptys in real time, or a rig in virtual time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from typing import Final, Protocol

from tickrig.device.rtc_lite.config import LiteConfig
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.emulators.bench.child import running
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rtc_lite.device_type import COMPONENTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.control.client import ControlClient
from tickrig.host.control.clock import RealClock
from tickrig.host.links.link import Link
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.real_time import RealTime

NODES: Final = {"LiteA": "lite-a", "LiteB": "lite-b"}
"""Which node plays which part."""

BAUD: Final = 57_600
EMULATOR: Final = "tickrig.emulators.rtc_lite.cli"
PATIENCE_S: Final = 30.0
"""How long an emulator may take to answer on a busy machine."""

POWER_CUT: Final = "power_cut"


class DemoSetup(Protocol):
    """Two devices, and a system that is not yet there.

    Attributes:
        manager: of the system.
        links: the lines to the devices.
        places: where the devices are, for people.
    """

    manager: Manager
    links: Mapping[str, Link[bytes]]
    places: Mapping[str, str]

    def step(self) -> None:
        """Let time pass until the system has done something."""

    def power(self, name: str, *, on: bool) -> None:
        """Cut a device's power, or give it back."""


class VirtualSetup:
    """Serial lines in a rig; time passes as fast as it can be computed."""

    def __init__(self) -> None:
        lines = {name: SerialLine(BAUD) for name in NODES}
        self._nodes = {
            name: RtcLiteNode(COMPONENTS[node], LiteConfig()) for name, node in NODES.items()
        }
        self._rig = Rig(*(Station(self._nodes[name], line.a) for name, line in lines.items()))
        self.manager = Manager()
        self.links: Mapping[str, Link[bytes]] = {
            name: SimLink(self._rig, line.b) for name, line in lines.items()
        }
        self.places: Mapping[str, str] = dict.fromkeys(NODES, "a serial line in virtual time")

    def step(self) -> None:
        """Run the rig until the system is due, and tick it."""
        self._rig.run_to(max(self.manager.due_us, self._rig.now_us))
        self.manager.tick(self._rig.now_us)

    def power(self, name: str, *, on: bool) -> None:
        """Cut or give the power of a node."""
        self._nodes[name].inputs.set(POWER_CUT, 0 if on else 1)


class PtySetup:
    """Emulators in processes of their own, each on a pseudo-terminal, in real time."""

    def __init__(
        self,
        links: Mapping[str, Link[bytes]],
        controls: Mapping[str, ControlClient],
        places: Mapping[str, str],
    ) -> None:
        self.manager, self.links, self.places, self._controls = Manager(), links, places, controls
        self._runner = RealTime(self.manager, RealClock())

    def step(self) -> None:
        """Wait until the system is due, and tick it."""
        self._runner.step()

    def power(self, name: str, *, on: bool) -> None:
        """Tell the emulator."""
        if on:
            self._controls[name].request("clear", name=POWER_CUT)
        else:
            self._controls[name].request("fault", spec=POWER_CUT)


@contextmanager
def pty_setup() -> Iterator[PtySetup]:
    """Start both emulators, and open their terminals.

    Raises:
        RuntimeError: an emulator does not start.
        LinkClosed: its terminal cannot be opened.
    """
    with ExitStack() as stack:
        links, controls, places = dict[str, Link[bytes]](), dict[str, ControlClient](), {}
        for name, node in NODES.items():
            child = stack.enter_context(running(EMULATOR, f"--node={node}", f"--baud={BAUD}"))
            control = ControlClient(child.control, PATIENCE_S)
            controls[name] = stack.enter_context(control)
            links[name] = stack.enter_context(closing(SerialLink(str(child.link), BAUD)))
            places[name] = str(child.link.resolve())
        yield PtySetup(links, controls, places)
