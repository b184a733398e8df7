"""RT components in virtual time: periods, port writes, CDR."""

from __future__ import annotations

from benchmarks.table import rates
from tickrig.host.rtc import (
    ExecutionContext,
    InPort,
    Manager,
    ModuleSpec,
    OutPort,
    ReturnCode,
    RtComponent,
    connect,
)
from tickrig.wire.rtc_types.cdr import decode, encode
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.iis import TimedPath2DSeq
from tickrig.wire.rtc_types.rtc import Pose2D, Time, TimedLong, Velocity2D

COMPONENTS = 1_000
PERIODS = 300
WRITES = 50_000
CALLS = 5_000


class Idle(RtComponent):
    """Counts its periods."""

    spec = ModuleSpec("Idle")
    count = 0

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Count."""
        self.count += 1
        return ReturnCode.RTC_OK


class Relay(RtComponent):
    """Passes a number on."""

    spec = ModuleSpec("Relay")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedLong))
        self.out = self.add_port(OutPort("out", TimedLong))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Pass on what arrived."""
        if self.in_.is_new and (value := self.in_.read()) is not None:
            self.out.write(value)
        return ReturnCode.RTC_OK


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    periods(f"{COMPONENTS} components in one context", Idle, shared=True)
    periods(f"{COMPONENTS} components, a context each", Idle, shared=False)
    relays()
    for interface in ("direct", "corba_cdr"):
        writes(interface)
    path = TimedPath2DSeq(Time(), (), (Pose2D(),) * 20, (Velocity2D(),) * 20)
    for value in (TimedLong(Time(1, 2), 3), path):
        cdr(value)


def made(kind: type[RtComponent], *, shared: bool) -> Manager:
    """Return a manager with active components at 1 kHz."""
    manager, context = Manager(), ExecutionContext() if shared else None
    for n in range(COMPONENTS):
        manager.add(kind(f"C{n}"), context=context)
    if context is not None:
        context.start()
    manager.activate(*(component.instance_name for component in manager.components))
    manager.run_for(1_000)
    return manager


def periods(what: str, kind: type[RtComponent], *, shared: bool) -> None:
    """Run components that do nothing."""
    manager = made(kind, shared=shared)
    amount = COMPONENTS * PERIODS
    rates(what, amount, "on_execute/s", lambda: manager.run_for(PERIODS * 1_000))


def relays() -> None:
    """Run a ring of relays, each with a number in each period."""
    manager = made(Relay, shared=True)
    for n in range(COMPONENTS):
        manager.connect(f"C{n}.out", f"C{(n + 1) % COMPONENTS}.in")
    for component in reversed(manager.components):
        component.ports["out"].connectors[0].write(TimedLong())
    what = f"{COMPONENTS} relays in one context"
    rates(what, COMPONENTS * PERIODS, "on_execute/s", lambda: manager.run_for(PERIODS * 1_000))


def writes(interface: str) -> None:
    """Write and read a number again and again."""
    out, in_ = OutPort("out", TimedLong), InPort("in", TimedLong)
    connect(out, in_, {"dataport.interface_type": interface})
    value = TimedLong(Time(1, 2), 3)

    def work() -> None:
        for _ in range(WRITES):
            out.write(value)
            in_.read()

    rates(f"write and read, {interface}", WRITES, "/s", work)


def cdr(value: Struct) -> None:
    """Encode and decode a value."""
    kind, data = type(value), encode(value)

    def work() -> None:
        for _ in range(CALLS):
            decode(kind, encode(value))

    rates(f"encode and decode {kind.__name__}, {len(data)} bytes", CALLS, "/s", work)
