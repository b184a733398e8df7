"""The proxy of an RTC-Lite device: round trips in virtual time and on a pty."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing, contextmanager

from benchmarks.table import percentiles, rates
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.emulators.bench.child import running
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.link import Link
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import ExecutionContext, OutPort, ReturnCode, connect
from tickrig.host.rtc.lite import RtcLiteProxy
from tickrig.wire.rtc_types.rtc import Time, TimedLong

BAUD = 57_600
PERIODS = 2_000


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    virtual()
    with pty_link() as link:
        on_pty(link, seconds)


def virtual() -> None:
    """Execute, with nothing to hand in and with a value, on a line of 57600 bit/s."""
    line, node = SerialLine(BAUD), RtcLiteNode(LiteEcho)
    proxy, out = active(SimLink(Rig(Station(node, line.a)), line.b))
    context = ExecutionContext()

    def execute() -> None:
        for _ in range(PERIODS):
            proxy.on_execute(context)

    def pass_on() -> None:
        for number in range(PERIODS):
            out.write(TimedLong(Time(), number))
            proxy.on_execute(context)

    rates("RtcLiteProxy.on_execute, virtual time", PERIODS, "round trips/s", execute)
    rates("the same with a value in and out", 2 * PERIODS, "round trips/s", pass_on)


def on_pty(link: Link[bytes], seconds: float) -> None:
    """Execute again and again, each time with a value that comes back."""
    proxy, out = active(link)
    context, latencies = ExecutionContext(), list[float]()
    end_s = time.monotonic() + seconds
    while (begin_s := time.monotonic()) < end_s:
        out.write(TimedLong(Time(), len(latencies)))
        if proxy.on_execute(context) is not ReturnCode.RTC_OK:
            print("| a period failed | | |")
        latencies.append(1_000 * (time.monotonic() - begin_s))
    rate = 2 * len(latencies) / sum(latencies) * 1_000
    what = f"rtc-lite-emu on a pty, {seconds:g} s, {rate:,.4g} round trips/s"
    percentiles(f"{what}: a value in and out", latencies, "ms")


def active(link: Link[bytes]) -> tuple[RtcLiteProxy, OutPort[TimedLong]]:
    """Return an active proxy, and a port joined to its InPort."""
    proxy, out = RtcLiteProxy("Echo0", link), OutPort("out", TimedLong)
    proxy.initialize()
    connect(out, proxy.ports["in"])
    proxy.on_activated(ExecutionContext())
    return proxy, out


@contextmanager
def pty_link() -> Iterator[Link[bytes]]:
    """Run an emulator in a process of its own, and open its terminal."""
    with (
        running("tickrig.emulators.rtc_lite.cli") as child,
        closing(SerialLink(str(child.link), BAUD)) as link,
    ):
        yield link
