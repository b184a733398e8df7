"""How many slaves keep a SYNC cycle of 10 ms in real time, on a bus of python-can.

The slaves sit on an emulated wire of 1 Mbit/s, where a TPDO of 8 bytes takes about
0.12 ms: 40 of them fill 5 ms, whatever the machine can do.
"""

from __future__ import annotations

import os
import threading
import time

import can

from benchmarks.canopen import tpdo_dictionary
from benchmarks.table import percentiles
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.bridge import CanBridge
from tickrig.emulators.can.outside.bus_port import CanBusPort
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.control.clock import RealClock

CYCLE_S = 0.01
SLAVES = (8, 16, 24, 32, 40)


def run(seconds: float) -> None:
    """Print a row for each number of slaves; TICKRIG_CAN names another interface and channel."""
    interface, _, channel = os.environ.get("TICKRIG_CAN", "virtual:pace").partition(":")
    for count in SLAVES:
        with (
            can.Bus(interface=interface, channel=channel) as inside,
            can.Bus(interface=interface, channel=channel) as outside,
        ):
            measure(count, seconds / len(SLAVES), inside, outside)


def measure(count: int, seconds: float, inside: can.BusABC, outside: can.BusABC) -> None:
    """Run slaves in a thread, be their master here, time the last TPDO behind each SYNC."""
    wire = CanWire()
    stations = [
        Station(make_slave(tpdo_dictionary(False), n), wire.end()) for n in range(1, count + 1)
    ]
    bridge = CanBridge(wire.end(), CanBusPort(inside))
    rig, stop = Rig(*stations, bridges=[bridge], clock=RealClock()), threading.Event()

    def turn() -> None:
        while not stop.is_set():
            rig.run_for(10_000)

    thread = threading.Thread(target=turn)
    thread.start()
    try:
        time.sleep(0.5)
        outside.send(can.Message(arbitration_id=0, data=b"\x01\x00", is_extended_id=False))
        last = [cycle(outside, count) for _ in range(int(seconds / CYCLE_S))]
    finally:
        stop.set()
        thread.join()
    missed = sum(value is None for value in last)
    times = [1_000 * value for value in last if value is not None] or [float("nan")]
    name = type(outside).__name__
    percentiles(
        f"{count} slaves on {name}, {missed} of {len(last)} cycles incomplete: last TPDO",
        times,
        "ms",
    )


def cycle(bus: can.BusABC, count: int) -> float | None:
    """Send SYNC; return when the last TPDO came, None if one is missing at the end of the cycle."""
    start = time.monotonic()
    bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    heard, last = 0, 0.0
    while (rest := start + CYCLE_S - time.monotonic()) > 0:
        message = bus.recv(rest)
        if message is not None and 0x180 < message.arbitration_id < 0x200:
            heard, last = heard + 1, time.monotonic() - start
    return last if heard >= count else None
