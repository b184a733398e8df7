from __future__ import annotations

import os
import time
import tty
from collections.abc import Callable, Iterator, Sequence

import can
import pytest

from tests.interop.buses import MULTICAST, PORT
from tickrig.emulators.can.outside.interface import CHANNELS
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.host.canmon.model.frames import AnyFrame, Record
from tickrig.host.canmon.model.logs.log_file import LogTally
from tickrig.host.canmon.sources.bus_source import BusSource, merged
from tickrig.host.canmon.sources.source import BusSpec, Source, open_source
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.links.can_link import to_message
from tickrig.host.links.link import LinkClosed
from tickrig.wire.can import CanFrame, FdFrame

PATIENCE_US = 10_000_000


class Fed:
    """A reader that gives what it was given, and then is unplugged."""

    name, lost, stepped = "fed", 0, False

    def __init__(self, *batches: list[Record]) -> None:
        self.tally, self._batches, self.closed = LogTally(), iter(batches), False

    def read(self, timeout_us: int, /) -> list[Record]:
        for batch in self._batches:
            return batch
        raise LinkClosed("fed: Network is down")

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def bench() -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel="canmon-bench") as bus:
        yield bus


def wait(source: Source, done: Callable[[list[Record]], bool]) -> list[Record]:
    records: list[Record] = []
    deadline = time.monotonic() + PATIENCE_US / 1e6
    while not done(records):
        assert time.monotonic() < deadline
        records += source.poll(100_000)
    return records


def record(count: int) -> list[Record]:
    return [Record(number, "fed", CanFrame(number)) for number in range(count)]


@pytest.mark.realtime
def test_a_bus_is_named_by_interface_and_channel(bench: can.BusABC) -> None:
    source = open_source(["virtual:canmon-bench,123:7FF"])
    for can_id in (0x122, 0x123):
        bench.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=b"\x01"))
    (one,) = wait(source, bool)
    assert (one.channel, one.frame, one.sent) == ("canmon-bench", CanFrame(0x123, b"\x01"), False)
    source.close()


@pytest.mark.realtime
def test_options_name_a_bus_as_well_and_can_fd_is_heard(bench: can.BusABC) -> None:
    source = open_source([], BusOptions(interface="virtual", channel="canmon-bench"))
    bench.send(can.Message(arbitration_id=1, is_extended_id=False, is_fd=True, data=bytes(12)))
    bench.send(can.Message(arbitration_id=2, is_extended_id=False))
    heard = wait(source, lambda came: len(came) == 2)
    source.close()
    assert [one.frame for one in heard] == [FdFrame(1, bytes(12)), CanFrame(2)]


@pytest.mark.realtime
def test_frames_that_nobody_fetches_are_lost_and_counted() -> None:
    reader = Fed(record(4), record(4))
    source = BusSource([reader], [None], queue_frames=5)
    wait(source, lambda _: source.lost == 3)
    source.close()
    assert source.messages() == ["3 frames found the queue full"]


@pytest.mark.realtime
def test_what_came_before_the_bus_was_unplugged_is_still_returned() -> None:
    source = BusSource([Fed(record(2))], [None])
    assert len(wait(source, lambda _: source.ended)) == 2
    assert source.failed == "fed: Network is down"
    source.close()


@pytest.mark.realtime
def test_closing_twice_closes_each_bus() -> None:
    reader = Fed()
    source = BusSource([reader], [None])
    source.close()
    source.close()
    assert reader.closed


@pytest.mark.realtime
def test_an_adapter_on_a_serial_port_is_read_until_it_is_unplugged() -> None:
    adapter, port = os.openpty()
    tty.setraw(port)
    name = os.ttyname(port)
    source = open_source(
        [f"slcan:{name}@500k"], BusOptions(bus_kwargs=("sleep_after_open=0", "timeout=0.01"))
    )
    os.write(adapter, b"t70517F\r")
    (one,) = wait(source, bool)
    assert (one.channel, str(one.frame)) == (name, "705#7F")
    assert b"S6\r" in os.read(adapter, 100)
    os.close(port)
    os.close(adapter)
    wait(source, lambda _: source.ended)
    assert source.failed.startswith(f"{name}: ")
    source.close()


@pytest.mark.realtime
def test_a_bus_over_udp_stays_on_this_machine() -> None:
    group = "ff11::7469:636e"
    if why := MULTICAST.why_not():
        pytest.skip(why)
    source = open_source([f"udp:{group}"], BusOptions(bus_kwargs=(f"port={PORT}",)))
    with can.Bus(interface="udp_multicast", channel=group, port=PORT, hop_limit=0) as bus:
        bus.send(can.Message(arbitration_id=5, is_extended_id=False))
        (one,) = wait(source, bool)
    assert (one.channel, one.frame) == (group, CanFrame(5))
    assert merged(BusSpec("udp_multicast", group), BusOptions()).bus_kwargs == ("hop_limit=0",)
    source.close()


@pytest.mark.realtime
@pytest.mark.parametrize(
    "groups", [("239.74.163.65", "239.74.163.66"), ("ff11::7469:6370", "ff11::7469:6371")]
)
def test_groups_on_one_port_do_not_hear_each_other(groups: tuple[str, str]) -> None:
    if why := MULTICAST.why_not():
        pytest.skip(why)
    options = BusOptions(bus_kwargs=(f"port={PORT}", "hop_limit=0"))
    source = open_source([f"udp:{group}" for group in groups], options)
    sent = [(group, CanFrame(can_id)) for can_id in (1, 2) for group in groups]
    for group, frame in sent:
        with can.Bus(interface="udp_multicast", channel=group, port=PORT, hop_limit=0) as bus:
            bus.send(to_message(frame))
    record = wait(source, lambda came: all(one in named(came) for one in sent[2:]))
    assert sorted(named(record), key=str) == sorted(sent, key=str)
    source.close()


def named(records: Sequence[Record]) -> list[tuple[str, AnyFrame]]:
    return [(one.channel, one.frame) for one in records]


def test_a_rig_in_virtual_time_is_a_bus_whose_time_passes_while_it_is_polled() -> None:
    rig = Rig()
    with CHANNELS.offer("desk", rig, CanWire()):
        source = open_source(["sim:desk"])
        assert source.poll(250_000) == []
        source.close()
    assert rig.now_us == 250_000


def test_a_bus_that_cannot_be_opened_fails() -> None:
    with pytest.raises(SourceFailed, match="nowhere"):
        open_source(["socketcan:nowhere"])


def test_an_unknown_interface_is_refused() -> None:
    with pytest.raises(Refused, match="'nothing' is not an interface of python-can"):
        open_source(["nothing:0"])


def test_a_bus_without_an_interface_is_of_socketcan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CAN_INTERFACE", raising=False)
    monkeypatch.setattr("can.util.CONFIG_FILES", [])
    with pytest.raises(SourceFailed, match="CAN bus socketcan nowhere"):
        open_source(["nowhere"])


def test_the_interface_may_be_configured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CAN_INTERFACE", "virtual")
    source = open_source(["bench"])
    assert (source.live, source.ended, source.messages()) == (True, False, [])
    source.close()


def test_buses_that_were_opened_are_closed_where_another_fails(bench: can.BusABC) -> None:
    with pytest.raises(SourceFailed):
        open_source(["virtual:canmon-bench", "socketcan:nowhere"])
