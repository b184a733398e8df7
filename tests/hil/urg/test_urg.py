"""A scanning range finder by SCIP 2.0: what it says, what it sees, and when it cannot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.hil.line_host import PATIENCE, LineHost
from tests.hil.rigs import RIGS
from tickrig import Bench
from tickrig.host import DeviceRefused, UrgClient

pytestmark = pytest.mark.needs("device:urg")


@pytest.fixture
def bench_config() -> Path:
    return RIGS / "urg.toml"


class Host(LineHost):
    """A host that reads answers line by line."""

    def ask(self, command: str) -> list[str]:
        """Send a command; return the lines of its answer."""
        self.send(command.encode() + b"\n")
        return self.reply()

    def reply(self) -> list[str]:
        """Return the lines of the next answer, which ends with an empty one."""
        text = self.answer(_up_to_empty_line)
        return text.decode("ascii").split("\n")


def _up_to_empty_line(data: bytes) -> tuple[bytes, bytes] | None:
    head, end, rest = data.partition(b"\n\n")
    return (head, rest) if end else None


@pytest.fixture
def host(bench: Bench) -> Host:
    """A host of a sensor that speaks SCIP 2.0, its laser off."""
    bench.run_for("100ms")
    host = Host(bench)
    host.send(b"\nSCIP2.0\n")
    bench.run_for("300ms")
    host.listen()
    host.heard = b""
    host.ask("QT")
    return host


def test_it_says_what_it_is(host: Host) -> None:
    told = host.ask("VV")
    assert told[:2] == ["VV", "00P"]
    assert any(line.startswith("PROT:SCIP 2.0") for line in told)


def test_its_laser_is_switched(host: Host) -> None:
    assert host.ask("BM")[:2] == ["BM", "00P"]
    assert host.ask("BM")[:2] == ["BM", "02R"]
    assert host.ask("QT")[:2] == ["QT", "00P"]


def test_an_unknown_command_is_refused(host: Host) -> None:
    assert host.ask("XX")[:2] == ["XX", "0Ee"]


def test_as_many_scans_come_as_were_asked_for(host: Host) -> None:
    assert host.ask("MD0384038401003") == ["MD0384038401003", "00P"]
    assert [host.reply()[0] for _ in range(3)] == [f"MD03840384010{left:02}" for left in (2, 1, 0)]
    host.bench.run_for("300ms")
    assert host.listen() == b""


def test_a_measurement_is_ended(host: Host) -> None:
    host.ask("MD0384038401000")
    host.reply()
    host.send(b"QT\n")
    assert host.bench.wait_until(lambda: b"QT\n00P\n\n" in host.listen(), within=PATIENCE)
    host.heard = b""
    host.bench.run_for("300ms")
    assert host.listen() == b""


def scans_of(client: UrgClient) -> Callable[[], bool]:
    """Return what polls a client, and says whether a scan has come by now."""
    return lambda: bool(client.poll())


@pytest.mark.needs("input:post")
def test_it_sees_who_steps_in_its_way(bench: Bench) -> None:
    client = UrgClient(bench.link)
    latest: dict[float, float] = {}

    def ahead() -> float:
        for scan in client.poll():
            latest.clear()
            latest.update(scan.points())
        return latest.get(0.0, 0.0)

    bench.set("post", 1.0, 0.0, 0.2)
    assert bench.wait_until(lambda: abs(ahead() - 0.8) < 0.05, within="5s")
    bench.set("post", 2.0, 0.0, 0.2)
    assert bench.wait_until(lambda: abs(ahead() - 1.8) < 0.05, within="5s")


@pytest.mark.needs("fault:motor_jammed")
def test_a_jammed_mirror_is_told(bench: Bench) -> None:
    client = UrgClient(bench.link)
    assert bench.wait_until(scans_of(client), within="5s")
    bench.fault("motor_jammed")
    with pytest.raises(DeviceRefused, match="status 51"):
        bench.wait_until(lambda: client.poll() is None, within="5s")


@pytest.mark.needs("fault:power_cut")
def test_our_client_finds_it_again_after_a_power_cut(bench: Bench) -> None:
    client = UrgClient(bench.link)
    assert bench.wait_until(scans_of(client), within="5s")
    bench.fault("power_cut", for_="1s")
    bench.run_for("1s")
    client.poll()
    assert bench.wait_until(scans_of(client), within="10s")
