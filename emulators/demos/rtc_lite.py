"""`tickrig demo rtc-lite`: numbers through two devices, a power cut, and the recovery."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from typing import Final

from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.emulators.bench.child import running
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rtc_lite.device_type import COMPONENTS
from tickrig.emulators.rtc_lite.line import MonitoredLink
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.control.client import ControlClient
from tickrig.host.control.clock import RealClock
from tickrig.host.links.link import Link
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc.component import ExecutionContext
from tickrig.host.rtc.components import ConsoleIn, ConsoleOut
from tickrig.host.rtc.lite import ProxyEvent, ProxyEventType, ProxySettings, attach
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.schedule import RealTime

# Where the demonstration is played: two devices on ptys in real time, or a rig in virtual time.

NODES: Final = {"LiteA": "lite-a", "LiteB": "lite-b"}
"""Names of the nodes by name of the proxy."""

_BAUD: Final = 57_600
_EMULATOR: Final = "tickrig.emulators.rtc_lite.cli"
_PATIENCE_S: Final = 30.0
"""Time-out of an answer of an emulator on a busy machine."""

_POWER_CUT: Final = "power_cut"


class VirtualSetup:
    """The nodes of the RTC-Lite demonstration on serial lines in virtual time.

    Virtual time passes as fast as it can be computed.
    """

    def __init__(self) -> None:
        lines = {name: SerialLine(_BAUD) for name in NODES}
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
        """Switch the power of a node."""
        self._nodes[name].inputs.set(_POWER_CUT, 0 if on else 1)


class _PtySetup:
    """Emulators in separate processes, each on a pseudo-terminal, in real time."""

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
        """Switch the power of a node in its emulator."""
        if on:
            self._controls[name].request("clear", name=_POWER_CUT)
        else:
            self._controls[name].request("fault", spec=_POWER_CUT)


_DemoSetup = VirtualSetup | _PtySetup


@contextmanager
def pty_setup() -> Iterator[_PtySetup]:
    """Context manager that runs each node of the RTC-Lite demonstration in its own process.

    The nodes are emulated in real time, and the host reaches each node by a pseudo-terminal (pty).

    Raises:
        RuntimeError: an emulator does not start.
        LinkClosed: the terminal of an emulator cannot be opened.
    """
    with ExitStack() as stack:
        links, controls, places = dict[str, Link[bytes]](), dict[str, ControlClient](), {}
        for name, node in NODES.items():
            child = stack.enter_context(running(_EMULATOR, f"--node={node}", f"--baud={_BAUD}"))
            control = ControlClient(child.control, _PATIENCE_S)
            controls[name] = stack.enter_context(control)
            links[name] = stack.enter_context(closing(SerialLink(str(child.link), _BAUD)))
            places[name] = str(child.link.resolve())
        yield _PtySetup(links, controls, places)


# `tickrig demo rtc-lite`: numbers through two devices, a power cut, and the way back.

_Echo = Callable[[str], None]

_RATE_HZ: Final = 10.0
_NUMBERS: Final = (1, -5, 2_147_483_647)
_LAST: Final = 42
_PATIENCE_US: Final = 60_000_000
"""Longest duration of a chapter, on a machine so busy that the system recovers repeatedly."""

_LOST: Final = "LiteA0"
"""The proxy of the device whose power is cut."""

_CONNECTIONS: Final = (
    ("ConsoleIn0.out", "LiteA0.in"),
    ("LiteA0.out", "LiteB0.in"),
    ("LiteB0.out", "ConsoleOut0.in"),
)
_CHAIN: Final = ("ConsoleIn0", "LiteA0", "LiteB0", "ConsoleOut0")
_SETTINGS: Final = ProxySettings(rediscover=True)


def run_demo(setup: _DemoSetup, echo: _Echo) -> None:
    """Run the RTC-Lite demonstration, which takes six seconds of real or virtual time.

    Args:
        setup: nodes of the demonstration, in virtual time or as processes.
        echo: function that is called with each line to print.

    Raises:
        RuntimeError: an expected event did not happen in time.
        RtcRefused: a device does not start up.
    """
    _DemoRun(setup, echo).run()


class _DemoRun:
    """The system on a stage, and its display.

    In real time an answer may arrive after the time-out of its proxy. The proxy then enters the
    Error state, or it is removed and added again. `_restore` brings the system to Active from any
    of these states.
    """

    def __init__(self, setup: _DemoSetup, echo: _Echo) -> None:
        self._setup, self._echo, self._manager = setup, echo, setup.manager
        self._events: list[ProxyEvent] = []
        self._links = {name: MonitoredLink(link, self._say) for name, link in setup.links.items()}
        self._start_us = self._zero_us = self._now_us
        self._deadline_us = self._now_us + _PATIENCE_US

    def run(self) -> None:
        """Yield the title of each chapter, then play it."""
        for name, place in self._setup.places.items():
            self._echo(f"{name} is an emulated PIC on {place}.")
        self._echo("Times are seconds.")
        for title in self._chapters():
            self._echo(f"\n{title}")
            self._deadline_us = self._now_us + _PATIENCE_US

    def _chapters(self) -> Iterator[str]:
        yield "A proxy for each device makes it an RT component. All are connected and activated."
        self._set_up()
        yield "The numbers 1, -5, 2147483647 are typed."
        self._type(*_NUMBERS)
        yield "The power of LiteA is cut. Times count from now."
        self._cut()
        yield "Until the device is back, the others run on."
        self._run_until(lambda: self._now_us >= self._zero_us + 3_000_000)
        self._restore(*(name for name in _CHAIN if name != _LOST))
        self._show_system()
        yield "The power of LiteA is back. Times count from now."
        self._give_back()
        yield "Connected and activated again, it works."
        self._restore()
        self._type(_LAST)

    @property
    def _now_us(self) -> int:
        return next(iter(self._links.values())).now_us

    def _set_up(self) -> None:
        manager, context = self._manager, ExecutionContext(_RATE_HZ)
        self._context = context
        self._source = manager.add(ConsoleIn("ConsoleIn0"), context=context)
        for name in NODES:
            self._attach(name)
        self._sink = manager.add(ConsoleOut("ConsoleOut0"), context=context)
        self._sink.show = lambda value: self._say(f"ConsoleOut0 received {value.data}")
        context.start()
        self._restore()
        self._show_system()

    def _attach(self, name: str) -> None:
        """Add the proxy of a device; try again if the device starts up too slowly."""
        link, context, listener = self._links[name], self._context, self._on_event
        while True:
            try:
                attach(self._manager, link, name, _SETTINGS, listener=listener, context=context)
            except RtcRefused:
                if self._now_us > self._deadline_us:
                    raise
            else:
                return

    def _type(self, *numbers: int) -> None:
        for number in numbers:
            self._source.enter(number)
            while not self._arrives(number):  # a proxy that went to Error may have lost it
                self._restore()
                self._source.enter(number)

    def _arrives(self, number: int) -> bool:
        """Wait for a number; return False if a component leaves Active before it comes."""
        received = self._sink.received
        self._run_until(
            lambda: any(value.data == number for value in received) or not self._active(_CHAIN)
        )
        return any(value.data == number for value in received)

    def _cut(self) -> None:
        self._restore()
        self._events.clear()
        self._links["LiteA"].shown = True
        self._zero_us = self._now_us
        self._setup.power("LiteA", on=False)
        self._await(ProxyEventType.FATAL_ERROR)
        self._run_until(lambda: self._states().get(_LOST, "ERROR") == "ERROR")
        self._show_system()
        self._links["LiteA"].shown = False
        self._await(ProxyEventType.REMOVED)
        self._show_system()

    def _give_back(self) -> None:
        self._links["LiteA"].shown = True
        self._zero_us = self._now_us
        self._setup.power("LiteA", on=True)
        self._await(ProxyEventType.REDISCOVERED)
        self._links["LiteA"].shown = False
        self._show_system()

    def _restore(self, *names: str) -> None:
        """Reset components in Error, and join and activate Inactive ones, until all are Active."""
        names = names or _CHAIN

        def restored() -> bool:
            self._lead_on()
            return self._active(names)

        self._run_until(restored)

    def _lead_on(self) -> None:
        states = self._states()
        present = {profile.ports for profile in self._manager.connectors}
        for ports in _CONNECTIONS:
            if ports not in present and all(port.partition(".")[0] in states for port in ports):
                self._manager.connect(*ports)
        with suppress(RtcRefused):  # on its way to Error: the next step finds it there
            for name, state in states.items():
                if state == "ERROR":
                    self._manager.reset(name)
                elif state == "INACTIVE":
                    self._manager.activate(name)

    def _active(self, names: Iterable[str]) -> bool:
        states = self._states()
        return all(states.get(name) == "ACTIVE" for name in names)

    def _run_until(self, done: Callable[[], bool]) -> None:
        while not done():
            if self._now_us > self._deadline_us:
                raise RuntimeError(f"nothing came in {_PATIENCE_US // 1_000_000} s")
            self._setup.step()

    def _await(self, kind: ProxyEventType) -> None:
        wanted = kind, _LOST
        self._run_until(lambda: wanted in {(it.kind, it.instance_name) for it in self._events})

    def _on_event(self, event: ProxyEvent) -> None:
        self._events.append(event)
        self._say(f"* {event.kind} of {event.instance_name}")

    def _states(self) -> dict[str, str]:
        names = [component.instance_name for component in self._manager.components]
        return {name: self._manager.state_of(name).name for name in names}

    def _show_system(self) -> None:
        states = ", ".join(f"{name} {state.capitalize()}" for name, state in self._states().items())
        self._say(f"= {states}")
        for profile in self._manager.connectors:
            self._say(f"=   {' -> '.join(profile.ports)}")

    def _say(self, text: str) -> None:
        self._echo(f"  {(self._now_us - self._zero_us) / 1e6:7.3f} {text}")
