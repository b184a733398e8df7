"""`tickrig demo rtc-lite`: numbers through two devices, a power cut, and the way back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from tickrig.emulators.rtc_lite.demo.setup import NODES, DemoSetup
from tickrig.emulators.rtc_lite.frame_log import MonitoredLink
from tickrig.host.rtc.components import ConsoleIn, ConsoleOut
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc_lite import ProxyEvent, ProxyEventType, ProxySettings, attach
from tickrig.wire.rtc_types.basic import TimedLong

Echo = Callable[[str], None]

RATE_HZ: Final = 10.0
NUMBERS: Final = (1, -5, 2_147_483_647)
LAST: Final = 42
PATIENCE_US: Final = 8_000_000
"""The longest that a step of the demonstration may take."""

CONNECTIONS: Final = (
    ("ConsoleIn0.out", "LiteA0.in"),
    ("LiteA0.out", "LiteB0.in"),
    ("LiteB0.out", "ConsoleOut0.in"),
)
SETTINGS: Final = ProxySettings(rediscover=True)


def run_demo(setup: DemoSetup, echo: Echo) -> None:
    """Play it; it takes six seconds of the stage's time.

    Raises:
        RuntimeError: something did not come in time.
        RtcRefused: a device does not start up.
    """
    DemoRun(setup, echo).run()


class DemoRun:
    """The system on a stage, and what it looks like."""

    def __init__(self, setup: DemoSetup, echo: Echo) -> None:
        self._setup, self._echo, self._manager = setup, echo, setup.manager
        self._events: list[ProxyEvent] = []
        self._links = {name: MonitoredLink(link, self._say) for name, link in setup.links.items()}
        self._start_us = self._zero_us = self._now_us

    def run(self) -> None:
        """Give the title of each chapter, then play it."""
        for name, place in self._setup.places.items():
            self._echo(f"{name} is an emulated PIC on {place}.")
        self._echo("Times are seconds.")
        for title in self._chapters():
            self._echo(f"\n{title}")

    def _chapters(self) -> Iterator[str]:
        yield "A proxy for each device makes it an RT component. All are connected and activated."
        self._set_up()
        yield "The numbers 1, -5, 2147483647 are typed."
        self._type(*NUMBERS)
        yield "The power of LiteA is cut. Times count from now."
        self._cut()
        yield "Until the device is back, the others run on."
        self._run_until(lambda: self._now_us >= self._zero_us + 3_000_000)
        self._show_system()
        yield "The power of LiteA is back. Times count from now."
        self._give_back()
        yield "Connected and activated again, it works."
        self._join()
        self._activate()
        self._type(LAST)

    @property
    def _now_us(self) -> int:
        return next(iter(self._links.values())).now_us

    def _set_up(self) -> None:
        manager, context = self._manager, ExecutionContext(RATE_HZ)
        self._context = context
        self._source = manager.add(ConsoleIn("ConsoleIn0"), context=context)
        for name in NODES:
            attach(
                *(manager, self._links[name], name, SETTINGS),
                listener=self._on_event,
                context=context,
            )
        self._sink = manager.add(ConsoleOut("ConsoleOut0"), context=context)
        self._sink.show = self._arrived
        context.start()
        self._join()
        self._activate()
        self._show_system()

    def _type(self, *numbers: int) -> None:
        wanted = len(self._sink.received) + len(numbers)
        self._source.enter(*numbers)
        self._run_until(lambda: len(self._sink.received) == wanted)

    def _cut(self) -> None:
        self._links["LiteA"].shown = True
        self._zero_us = self._now_us
        self._setup.power("LiteA", on=False)
        self._await(ProxyEventType.FATAL_ERROR)
        self._run_until(lambda: self._states()["LiteA0"] == "ERROR")
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

    def _join(self) -> None:
        present = {profile.ports for profile in self._manager.connectors}
        for connection in CONNECTIONS:
            if connection not in present:
                self._manager.connect(*connection)

    def _activate(self) -> None:
        states = self._states()
        self._manager.activate(*(name for name, state in states.items() if state == "INACTIVE"))
        self._run_until(lambda: set(self._states().values()) == {"ACTIVE"})

    def _run_until(self, done: Callable[[], bool]) -> None:
        deadline_us = self._now_us + PATIENCE_US
        while not done():
            if self._now_us > deadline_us:
                raise RuntimeError(f"nothing came in {PATIENCE_US // 1_000_000} s")
            self._setup.step()

    def _await(self, kind: ProxyEventType) -> None:
        self._run_until(lambda: any(event.kind is kind for event in self._events))

    def _on_event(self, event: ProxyEvent) -> None:
        self._events.append(event)
        self._say(f"* {event.kind} of {event.instance_name}")

    def _arrived(self, value: TimedLong) -> None:
        self._say(f"ConsoleOut0 received {value.data}")

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
