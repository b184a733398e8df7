"""How much of a core 100 components at 100 Hz take whose data go over CORBA, in real time.

Two processes of `tickrig rtc run --openrtm`, 100 components each; this one joins their ports, as
RT System Editor would. Each component writes a TimedLong in each period. One way all of them go
to the peer; both ways those of 50 go there, and those of 50 come. A value is lost if a
later one of its component arrived.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from benchmarks.joints_pace import processor_s

COMPONENTS: Final = 100
RATE_HZ: Final = 100
TALK: Final = """
import atexit, json, sys
from tickrig.rtc import InPort, ModuleSpec, OutPort, ReturnCode, RtComponent, Time, TimedLong

counts = {"read": 0, "lost": 0}
atexit.register(lambda: print(json.dumps(counts), flush=True))

class Talk(RtComponent):
    spec = ModuleSpec("Talk", "Writes in each period, and reads what came")

    def __init__(self, instance_name):
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedLong))
        self.out = self.add_port(OutPort("out", TimedLong))
        self.number, self.next = 0, None

    def on_execute(self, ec):
        while self.in_.is_new:
            number = self.in_.read().data
            counts["read"] += 1
            counts["lost"] += 0 if self.next is None else number - self.next
            self.next = number + 1
        self.out.write(TimedLong(Time.from_us(ec.now_us), self.number))
        self.number += 1
        return ReturnCode.RTC_OK
"""


def run(seconds: float) -> None:
    """Print a row for each way that data go."""
    for what, both in (("one way", False), ("both ways", True)):
        with (
            tempfile.TemporaryDirectory() as folder,
            system(folder, "a") as first,
            system(folder, "b") as second,
        ):
            measure(what, (first, second), both=both, seconds=seconds / 2)


class System:
    """A system in a process of its own.

    Args:
        process: the command.
        manager: its reference.
    """

    def __init__(self, process: subprocess.Popen[str], manager: Any) -> None:
        self.process, self.manager = process, manager
        self.components = {one.get_sdo_id(): one for one in manager.get_components()}

    def activate(self) -> None:
        """Activate all components."""
        for component in self.components.values():
            component.get_owned_contexts()[0].activate_component(component)

    def deactivate(self) -> None:
        """Deactivate all components."""
        for component in self.components.values():
            component.get_owned_contexts()[0].deactivate_component(component)

    def port(self, name: str, number: int) -> Any:
        """Return a port of a component."""
        return self.components[name].get_ports()[number]

    def end(self) -> tuple[dict[str, int], str]:
        """End it; return how many values it read, how many between them not, and what it said."""
        self.manager.shutdown()
        said, told = self.process.communicate()
        counts: dict[str, int] = json.loads(said.splitlines()[-1])
        return counts, told.splitlines()[-1]


def free_port() -> int:
    """Return a port that is free now."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port: int = free.getsockname()[1]
    return port


@contextmanager
def system(folder: str, name: str) -> Iterator[System]:
    """Run a system of `COMPONENTS` components."""
    place, port = Path(folder, name), free_port()
    place.mkdir()
    entry = '[[component]]\nname = "T{}"\ntype = "Talk"\nrate_hz = {}.0\n'
    text = "".join(entry.format(n, RATE_HZ) for n in range(COMPONENTS))
    (place / "system.toml").write_text(text)
    (place / "talk.py").write_text(TALK)
    words = [place / "system.toml", "--component", f"{place}/talk.py:Talk", "--control"]
    words += [place / "ctl", "--openrtm", "127.0.0.1:1", "--openrtm-address", f"127.0.0.1:{port}"]
    command = [sys.executable, "-m", "tickrig", "rtc", "run", *words]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)
    try:
        yield System(process, reference(port))
    finally:
        process.kill()
        process.communicate()


def reference(port: int) -> Any:
    """Wait for the manager at a port."""
    from omniORB import CORBA  # noqa: PLC0415 - an extra

    from tickrig.host.rtc.engines.openrtm.stubs import stubs  # noqa: PLC0415

    idl, orb = stubs(), CORBA.ORB_init([], CORBA.ORB_ID)
    while True:
        try:
            found = orb.string_to_object(f"corbaloc::127.0.0.1:{port}/manager")
            return found._narrow(idl.rtm.Manager)
        except CORBA.SystemException:
            time.sleep(0.05)


def join(first: System, second: System, names: Sequence[str]) -> None:
    """Join OutPorts of a system with the InPorts of another one."""
    from tickrig.host.rtc.engines.openrtm.orb import nvlist  # noqa: PLC0415
    from tickrig.host.rtc.engines.openrtm.stubs import stubs  # noqa: PLC0415

    values = {
        "dataport.interface_type": "corba_cdr",
        "dataport.dataflow_type": "push",
        "dataport.subscription_type": "flush",
    }
    for name in names:
        ports = [first.port(name, 1), second.port(name, 0)]
        profile = stubs().rtc.ConnectorProfile(f"{name} out", "", ports, nvlist(values))
        code, _ = ports[0].connect(profile)
        assert str(code) == "RTC_OK", code


def measure(what: str, systems: tuple[System, System], *, both: bool, seconds: float) -> None:
    """Let them run, and print what the first one took."""
    first, second = systems
    names, some = list(first.components), COMPONENTS // 2 if both else COMPONENTS
    join(first, second, names[:some])
    join(second, first, names[some:])
    second.activate()
    first.activate()
    time.sleep(1)
    pids = [system.process.pid for system in systems]
    spent_s, begun_s = [processor_s(pid) for pid in pids], time.monotonic()
    time.sleep(seconds)
    took_s = time.monotonic() - begun_s
    shares = [(processor_s(pid) - spent) / took_s for pid, spent in zip(pids, spent_s, strict=True)]
    for system in systems:
        system.deactivate()
    (ours, ended), (theirs, _) = first.end(), second.end()
    read, lost = (ours[what] + theirs[what] for what in ("read", "lost"))
    print(
        f"| {COMPONENTS} components at {RATE_HZ} Hz, data over CORBA {what}:"
        f" {shares[0]:.2f} of a core, their peer {shares[1]:.2f} |"
        f" {read:,} values arrived, {lost:,} lost; {ended} | |",
        flush=True,
    )
