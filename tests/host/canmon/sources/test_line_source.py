from __future__ import annotations

import json
import os
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.emulators.serial.test_realtime import Child
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.frames import AnyRecord, LineRecord
from tickrig.host.canmon.sources.source import AnySource, LineSpec, open_any, parse_source
from tickrig.host.cli.can_options import BusOptions
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import Checksum, LiteFrame

PATIENCE_S = 10.0


class Port:
    """A pseudo-terminal, and its far end."""

    def __init__(self) -> None:
        self.far, self.near = os.openpty()
        tty.setraw(self.near)
        self._open: tuple[int, ...] = (self.near, self.far)
        self.path = os.ttyname(self.near)
        self.name = Path(self.path).name

    def write(self, data: bytes) -> None:
        os.write(self.far, data)

    def close(self) -> None:
        for descriptor in self._open:
            os.close(descriptor)
        self._open = ()


@pytest.fixture
def ports() -> Iterator[tuple[Port, Port]]:
    one, other = Port(), Port()
    yield one, other
    one.close()
    other.close()


def wait(
    source: AnySource[AnyRecord], done: Callable[[list[AnyRecord]], bool], again: Callable[[], None]
) -> list[AnyRecord]:
    """Poll until it is done; opening a port drops what had come before, so feed it again."""
    records: list[AnyRecord] = []
    deadline = time.monotonic() + PATIENCE_S
    while not done(records):
        assert time.monotonic() < deadline
        again()
        records += source.poll(10_000)
    return records


@contextmanager
def talking(port: Port, data: bytes) -> Iterator[None]:
    """Send bytes again and again until the block ends."""
    stop = threading.Event()

    def work() -> None:
        while not stop.wait(0.01):
            port.write(data)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words)


@pytest.mark.parametrize(
    ("word", "parsed"),
    [
        ("serial:/dev/ttyUSB0,rrc", LineSpec("/dev/ttyUSB0", None, "rrc")),
        ("serial:COM3@9600,rtc-lite,host", LineSpec("COM3", 9_600, "rtc-lite", from_host=True)),
        (
            "serial:socket://127.0.0.1:7@1M,rtc-lite-xor8",
            LineSpec("socket://127.0.0.1:7", 1_000_000, "rtc-lite-xor8"),
        ),
    ],
)
def test_a_word_names_a_port_its_rate_its_protocol_and_its_direction(
    word: str, parsed: LineSpec
) -> None:
    assert parse_source(word) == parsed


@pytest.mark.realtime
def test_both_directions_of_a_line_and_a_bus_are_one_trace(ports: tuple[Port, Port]) -> None:
    device, host = ports
    words = [f"serial:{device.path},rrc", f"serial:{host.path},rrc,host", f"virtual:{device.name}"]
    source = open_any(words, BusOptions())

    def feed() -> None:
        device.write(b"EV:PowerOn\n")
        host.write(b"output1eff\n")

    record = wait(source, lambda record: len({one.channel for one in record}) > 1, feed)
    source.close()
    lines = [one for one in record if isinstance(one, LineRecord)]
    assert {(one.channel, one.sent, one.decoded.text) for one in lines} == {
        (device.name, False, "event PowerOn"),
        (host.name, True, "output v_pct=30 w_pct=-1"),
    }


@pytest.mark.realtime
def test_frames_of_rtc_lite_are_told_with_their_checksum(ports: tuple[Port, Port]) -> None:
    port, _ = ports
    source = open_any([f"serial:{port.path},rtc-lite-xor8,host"], BusOptions())
    frame = LiteFrame(LiteCommand.ACTIVATE).encode(Checksum.XOR8)
    first = wait(source, bool, lambda: port.write(frame))[0]
    source.close()
    assert isinstance(first, LineRecord)
    assert first.decoded.text == "activate"


@pytest.mark.realtime
def test_a_port_that_is_unplugged_ends_it(ports: tuple[Port, Port]) -> None:
    port, _ = ports
    source = open_any([f"serial:{port.path},rrc"], BusOptions())
    port.close()
    deadline = time.monotonic() + PATIENCE_S
    while not source.ended:
        assert time.monotonic() < deadline
        source.poll(10_000)
    assert source.failed.startswith(f"cannot read from {port.path!r}")
    source.close()


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["dump", "serial:/dev/nowhere,rrc"], 3, "cannot open '/dev/nowhere'"),
        (["dump", "serial:/dev/nowhere,rrc", "-L"], 2, "a log holds frames alone"),
        (["dump", "serial:/dev/nowhere,rrc", "-l", "run.log"], 2, "a log holds frames alone"),
        (["dump", "serial:/dev/nowhere,rrc", "-"], 2, "cannot be mixed"),
        (["dump", "serial:/dev/nowhere,fax"], 2, "'fax' is no filter"),
        (["stats", "serial:/dev/nowhere,rrc"], 2, "serial lines are shown by dump, top and tui"),
    ],
)
def test_a_mistake_is_one_line(words: list[str], status: int, said: str) -> None:
    result = canmon(*words)
    assert result.exit_code == status
    assert said in result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.realtime
def test_what_rrc_emu_says_is_shown_and_counted(tmp_path: Path) -> None:
    child = Child(tmp_path)
    try:
        child.wait_until_up()
        source = open_any([f"serial:{child.link},rrc"], BusOptions())
        child.ctl("press", "power_button")
        record = wait(source, lambda record: "event PowerOnSuccess" in texts(record), lambda: None)
        source.close()
    finally:
        child.end()
    assert texts(record)[-2:] == ["event PowerOnTrigger", "event PowerOnSuccess"]


def texts(records: list[AnyRecord]) -> list[str]:
    return [one.decoded.text for one in records if isinstance(one, LineRecord)]


@pytest.mark.realtime
def test_dump_and_top_show_lines(ports: tuple[Port, Port]) -> None:
    port, _ = ports
    word = f"serial:{port.path},rrc"
    with talking(port, b"SA:64003200A1000F\r\n"):
        said = json.loads(canmon("dump", word, "--jsonl", "-n", "1").stdout)
        text = canmon("dump", word, "-n", "1", "-F", "gauge = 10").stdout
        top = canmon("top", word, "--for", "300ms", "-F", "rrc").stdout
    assert (said["ev"], said["ch"], said["kind"], said["sig"]["gauge"]) == (
        "line",
        port.name,
        "rrc",
        10,
    )
    assert text.startswith(f"  {port.name}  <  SA:64003200A1000F ")
    assert f"\n{port.name} < status " in top
