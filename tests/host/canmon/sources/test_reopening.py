"""A bus that goes away and comes back."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
import tty
from collections.abc import Callable, Sequence
from pathlib import Path
from queue import SimpleQueue

import pytest

from tests.host.canmon.terminal import Terminal
from tickrig.host.canmon.model.frames import CandumpFilter, Record
from tickrig.host.canmon.model.logs.can_log import channel_name
from tickrig.host.canmon.model.logs.log_file import BACK, GONE, LogTally, Mark
from tickrig.host.canmon.sources.live_source import REOPEN_US, LiveSource, ReopeningReader
from tickrig.host.cli.messages import SourceFailed
from tickrig.host.links.link import LinkClosed
from tickrig.wire.can import CanFrame

CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")
PATIENCE_S = 20.0


def record(number: int) -> Record:
    return Record(number, "bus", CanFrame(number))


class Plugged:
    """A reader that gives its frames, one at a time, and then is unplugged."""

    name, stepped = "bus", False

    def __init__(self, *numbers: int, lost: int = 0) -> None:
        self.tally, self.lost = LogTally(), lost
        self._numbers, self.closed = list(numbers), False

    def read(self, timeout_us: int, /) -> list[Record]:
        if not self._numbers:
            raise LinkClosed("bus: Network is down")
        return [record(self._numbers.pop(0))]

    def close(self) -> None:
        self.closed = True


class Time:
    """A clock that goes on while somebody waits."""

    def __init__(self) -> None:
        self.now_us = 0

    def wait(self, seconds: float) -> None:
        self.now_us += round(seconds * 1e6)


def reopening(first: Plugged, *others: Plugged | Exception) -> ReopeningReader[Record]:
    left, time = list(others), Time()

    def open_reader() -> Plugged:
        other = left.pop(0)
        if isinstance(other, Exception):
            raise other
        return other

    reader = ReopeningReader(first, open_reader, lambda: time.now_us, time.wait)
    reader.wanted = True
    return reader


def read_all(reader: ReopeningReader[Record], count: int) -> list[Record | Mark]:
    found: list[Record | Mark] = []
    while len(found) < count:
        found += reader.read(100_000)
    return found


def test_a_gap_is_marked_at_both_ends() -> None:
    first = Plugged(1, 2)
    one, two, gone, back, three = read_all(reopening(first, Plugged(3, 4)), 5)
    assert (one, two, three) == (record(1), record(2), record(3))
    assert isinstance(gone, Mark)
    assert isinstance(back, Mark)
    assert (gone.event, gone.text) == (GONE, "bus is gone: Network is down")
    assert (back.event, back.away_us) == (BACK, REOPEN_US)
    assert first.closed


@pytest.mark.parametrize(
    "error", [SourceFailed("no such bus"), OSError(19, "No such device"), LinkClosed("no port")]
)
def test_it_is_tried_again_until_it_opens_and_is_read(error: Exception) -> None:
    down = Plugged()  # opens, and cannot be read: an interface that is down
    reader = reopening(Plugged(1), error, down, error, Plugged(2))
    *_, back, last = read_all(reader, 4)
    assert isinstance(back, Mark)
    assert (back.away_us, last) == (4 * REOPEN_US, record(2))
    assert down.closed
    assert (reader.gaps, reader.away) == (1, False)
    assert reader.losses() == ["bus: it was away once, 2.000 s in all"]


def test_losses_of_all_readers_are_counted() -> None:
    reader = reopening(Plugged(1, lost=3), Plugged(2, lost=4), SourceFailed("gone"))
    read_all(reader, 5)
    reader.read(100_000)
    assert (reader.lost, reader.gaps) == (7, 2)
    assert reader.losses() == [
        "bus: it was away twice".replace("twice", "2 times") + (", 0.600 s in all, and is not back")
    ]
    reader.close()
    assert reader.lost == 7


def test_it_is_left_alone_where_nobody_wants_it() -> None:
    reader = reopening(Plugged(), Plugged(2))
    reader.wanted = False
    with pytest.raises(LinkClosed):
        reader.read(1)


class Fed:
    """A reader that gives what a test puts in."""

    name, lost, stepped = "bus", 0, False

    def __init__(self) -> None:
        self.tally, self.queue = LogTally(), SimpleQueue[Sequence[Record | Mark]]()

    def read(self, timeout_us: int, /) -> Sequence[Record | Mark]:
        return self.queue.get()

    def close(self) -> None:
        pass


def test_a_poll_ends_at_a_mark() -> None:
    reader, mark = Fed(), Mark(0, GONE, "bus is gone")
    source: LiveSource[Record] = LiveSource([reader], [CandumpFilter.parse("001:7FF,002:7FF")])
    batches: list[list[Record | Mark]] = [[record(1), record(3)], [mark], [mark, record(2)], []]
    for batch in batches:
        reader.queue.put(batch)
    found: list[tuple[list[Record], Sequence[Mark]]] = []
    while sum(len(records) for records, _ in found) < 2:
        found.append((source.poll(10_000_000), source.marks))
    events = [one for records, marks in found for one in (*records, *marks)]
    assert events == [record(1), mark, mark, record(2)]
    assert source.poll(0) == []
    assert source.marks == ()
    reader.queue.put([])
    source._stop = True
    reader.queue.put([])
    source.close()


def test_a_full_queue_keeps_marks() -> None:
    reader, mark = Fed(), Mark(0, GONE, "bus is gone")
    source: LiveSource[Record] = LiveSource([reader], queue_frames=1)
    reader.queue.put([record(1)])
    reader.queue.put([mark, record(2)])
    reader.queue.put([])
    while source.lost < 1:
        time.sleep(0)
    assert (source.poll(0), source.marks) == ([record(1)], (mark,))
    source._stop = True
    reader.queue.put([])
    source.close()


class Adapter:
    """A CAN adapter on a serial port that can be unplugged: a link to a terminal."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.plug()

    @property
    def name(self) -> str:
        """As frames have it."""
        return channel_name(self.link)

    def plug(self) -> None:
        self._adapter, self._port = os.openpty()
        tty.setraw(self._port)
        self.link.symlink_to(os.ttyname(self._port))

    def unplug(self) -> None:
        self.link.unlink()
        os.close(self._port)
        os.close(self._adapter)

    def send(self, text: bytes) -> None:
        os.write(self._adapter, text)

    def opened(self) -> None:
        """Wait until somebody has opened the channel."""
        said = b""
        while b"O\r" not in said:
            assert select.select([self._adapter], [], [], PATIENCE_S)[0], said
            said += os.read(self._adapter, 100)


def wait(done: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.realtime
def test_dump_waits_for_an_adapter_that_was_unplugged(tmp_path: Path) -> None:
    adapter, out, err = Adapter(tmp_path / "adapter"), tmp_path / "out", tmp_path / "err"
    bus = [f"slcan:{adapter.link}", "--bus-kwargs", "sleep_after_open=0", "timeout=0.01"]
    words = [*CANMON, "dump", "-b", "500000", "-L", "--reopen", "--strict", "-n", "2", *bus]
    with out.open("wb") as stdout, err.open("wb") as stderr:
        child = subprocess.Popen(words, stdout=stdout, stderr=stderr)
    try:
        adapter.opened()
        adapter.send(b"t70517F\r")
        wait(lambda: b"705#7F" in out.read_bytes())
        adapter.unplug()
        wait(lambda: b"is gone" in err.read_bytes())
        adapter.plug()
        adapter.opened()
        adapter.send(b"t705105\r")
        assert child.wait(PATIENCE_S) == 4
    finally:
        child.kill()
        child.wait()
    first, gone, back, last = out.read_text("ascii").splitlines()
    assert (first.endswith("705#7F"), last.endswith("705#05")) == (True, True)
    assert gone.startswith(f"# {adapter.name} is gone: ")
    assert back.startswith(f"# {adapter.name} is back after ")
    said = err.read_text("utf-8").splitlines()
    assert said[:2] == [gone[2:], back[2:]]
    assert said[2].startswith(f"{adapter.name}: it was away once, ")
    assert said[-1] == "Error: a bus was away 1 time"


@pytest.mark.realtime
def test_top_tells_which_bus_is_gone(tmp_path: Path) -> None:
    adapter = Adapter(tmp_path / "adapter")
    bus = [f"slcan:{adapter.link}", "--bus-kwargs", "sleep_after_open=0", "timeout=0.01"]
    terminal = Terminal("top", "-b", "500000", "--reopen", *bus, columns=140)
    adapter.opened()
    adapter.send(b"t70517F\r")
    terminal.wait_for("705")
    adapter.unplug()
    terminal.wait_for(f"GONE: {adapter.name}")
    adapter.plug()
    adapter.opened()
    adapter.send(b"t706105\r")
    terminal.wait_for("706")
    terminal.child.send("q")
    assert terminal.end() == 0
    assert f"{adapter.name}: it was away once, " in terminal.written
