"""Ports of an RT component over CORBA, beside omniORB to omniORB."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import omniORB

from benchmarks.table import RUNS, row
from tickrig.host.cli.engine_options import Endpoint
from tickrig.host.control.clock import ServingClock
from tickrig.host.rtc import ExecutionContext, InPort, Manager, ModuleSpec, OutPort, ReturnCode
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.openrtm.connector_ends import INPORT_IOR, InPortClient, texts
from tickrig.host.rtc.engines.openrtm.orb import Orb
from tickrig.host.rtc.engines.openrtm.port_service import ComponentPorts, SystemPorts
from tickrig.host.rtc.engines.openrtm.stubs import DATA_TYPES, IDL, compile_idl, stubs
from tickrig.host.rtc.engines.peer_ports import OutPortPushConnector, PeerEnd, cdr
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.peer_thread import PeerThread
from tickrig.host.rtc.system.schedule import RealTime
from tickrig.wire.rtc_types.cdr import decode, encode
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.iis import TimedPath2DSeq
from tickrig.wire.rtc_types.rtc import Pose2D, Time, TimedLong, TimedOctetSeq, Velocity2D

VALUE = TimedOctetSeq(Time(1, 2), bytes(52))
PAYLOAD = encode(VALUE)
"""64 octets."""

PUTS = 2_000


class Sink(RtComponent):
    """Reads what arrives."""

    spec = ModuleSpec("Sink")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedOctetSeq))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Read."""
        while self.in_.is_new:
            self.in_.read()
        return ReturnCode.RTC_OK


class Plain:
    """An InPortCdr that does nothing."""

    def __init__(self) -> None:
        self._ok = stubs().openrtm.PORT_OK

    def put(self, data: bytes) -> Any:
        """Take a value."""
        return self._ok


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    orb = Orb(Endpoint())
    try:
        with Server(orb) as server:
            puts(server)
        codecs()
    finally:
        orb.close()


class Server:
    """A component in a process of its own, beside a servant of nobody.

    Attributes:
        plain: what that servant is called by.
        into: what the component's InPort is put into by.
    """

    def __init__(self, orb: Orb) -> None:
        words = [sys.executable, "-c", "from benchmarks.openrtm import serve; serve()"]
        path = {**os.environ, "PYTHONPATH": ":".join(sys.path)}
        self._process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=path)
        assert self._process.stdout is not None
        plain, port = self._process.stdout.readline().split()
        rtc, kind = stubs().rtc, stubs().openrtm.InPortCdr
        self.plain = orb.reference(plain)._unchecked_narrow(kind)
        service = orb.reference(port)._unchecked_narrow(rtc.PortService)
        peer = orb.reference(plain)._unchecked_narrow(rtc.PortService)
        profile = rtc.ConnectorProfile("bench", "bench", [peer, service], [])
        code, profile = service.notify_connect(profile)
        assert code == rtc.RTC_OK
        ior = texts(profile.properties)[INPORT_IOR]
        self.into = orb.reference(ior)._unchecked_narrow(kind)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.kill()
        self._process.communicate()


def serve() -> None:
    """Run a component at 1 kHz until the process is killed; in the process of the server."""
    orb, manager, calls = Orb(Endpoint()), Manager(), CallQueue()
    ports = SystemPorts(orb, calls, manager)
    sink = manager.add(Sink("Sink0"))
    ComponentPorts(ports, sink, None)
    manager.activate("Sink0")
    plain = orb.serve(stubs().skeleton("OpenRTM.InPortCdr"), Plain())
    print(orb.text(plain), orb.text(ports.references[sink.in_]), flush=True)
    clock = ServingClock()
    clock.serve = calls.serve
    RealTime(manager, clock).run()


def puts(server: Server) -> None:
    """Time puts in turn: into a servant of nobody, into a port of ours, out of a port of ours."""
    thread = PeerThread("bench")
    out = OutPort("out", TimedOctetSeq)
    end = PeerEnd("plain", "a", {"dataport.outport.buffer.length": str(PUTS)})
    pushed = OutPortPushConnector(
        out, end, cdr(TimedOctetSeq), InPortClient(server.plain, "plain"), thread
    )
    pushed.begin()

    def write() -> None:
        wanted = pushed.sent + PUTS
        for _ in range(PUTS):
            out.write(VALUE)
        while pushed.sent < wanted:
            time.sleep(0.0002)

    works = {
        "omniORB to omniORB": lambda: call(server.plain.put),
        "into an InPort": lambda: call(server.into.put),
        "out of an OutPort": write,
    }
    taken: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(RUNS):
        for name, work in works.items():
            taken[name].append(timed(work) / PUTS * 1e6)
    for name, values in taken.items():
        row(f"a put of {len(PAYLOAD)} octets, {name}", values, "us")
        if values is not (plain := taken["omniORB to omniORB"]):
            ratio = [value / base for value, base in zip(values, plain, strict=True)]
            row(f"{name}, as a multiple of that", ratio, "x")
    thread.close()


def codecs() -> None:
    """Encode and decode in turn: with omniORB from Python, and without."""
    path = TimedPath2DSeq(Time(), (), (Pose2D(),) * 20, (Velocity2D(),) * 20)
    with tempfile.TemporaryDirectory() as folder:
        compile_idl([IDL / DATA_TYPES], Path(folder), "benchmark_types")
        sys.path.insert(0, folder)
        for value in (TimedLong(Time(1, 2), 3), path):
            module, _, name = type(value).idl_id()[4:-4].partition("/")
            codec(value, getattr(import_module(f"benchmark_types.{module}"), f"_tc_{name}"))
        sys.path.remove(folder)


def codec(value: Struct, code: Any) -> None:
    """Encode and decode one value, whose type code omniORB has."""
    kind, data = type(value), encode(value)
    theirs = omniORB.cdrUnmarshal(code, data, True)
    works: dict[str, Callable[[], object]] = {
        "omniORB": lambda: omniORB.cdrUnmarshal(code, omniORB.cdrMarshal(code, theirs, True), True),
        "ours": lambda: decode(kind, encode(value)),
    }
    rates: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(RUNS):
        for name, work in works.items():
            start_s = time.process_time()
            for _ in range(PUTS):
                work()
            rates[name].append(PUTS / (time.process_time() - start_s))
    what = f"encode and decode {kind.__name__}, {len(data)} bytes"
    row(f"{what}, omniORB from Python", rates["omniORB"], "/s")
    ratio = [ours / base for ours, base in zip(rates["ours"], rates["omniORB"], strict=True)]
    row(f"{what}, as a multiple of that", ratio, "x")


def call(put: Callable[[bytes], Any]) -> None:
    """Put again and again."""
    for _ in range(PUTS):
        put(PAYLOAD)


def timed(work: Callable[[], object]) -> float:
    """Return the wall time of some work: half of it passes in the other process."""
    start_s = time.perf_counter()
    work()
    return time.perf_counter() - start_s
