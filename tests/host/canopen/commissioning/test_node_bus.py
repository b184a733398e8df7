"""A bus from one thread: SDO, NMT, what is left behind when somebody ends it."""

from __future__ import annotations

import pytest

from tests.host.canopen.commissioning.net_bench import NetBench
from tickrig.device import make_epos, make_f_palette
from tickrig.host.canopen.commissioning.node_bus import NetworkScan
from tickrig.host.canopen.errors import SdoTimeout
from tickrig.host.links.link import StampedFrames
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

WAIT_US = 50_000


def test_an_object_is_written_and_read() -> None:
    bench = NetBench(make_epos(5))
    bench.bus.write(5, 0x1017, 0, b"\x64\0")
    assert bench.bus.read(5, 0x1017, 0) == b"\x64\0"


def test_a_state_is_waited_for() -> None:
    bench = NetBench(make_epos(5))
    bench.bus.write(5, 0x1017, 0, b"\x0a\0")
    bench.bus.command(NmtCommand.START, 5)
    wanted = (NmtState.OPERATIONAL,)
    assert bench.bus.await_state(5, wanted, WAIT_US) is NmtState.OPERATIONAL
    assert bench.bus.await_state(6, wanted, WAIT_US) is None


class Interrupted(NetBench):
    """Somebody presses Ctrl-C when the bus was looked at so often."""

    def press_after(self, looks: int) -> None:
        receive = self.host.receive_stamped

        def receive_stamped(timeout_us: int) -> tuple[int, StampedFrames]:
            nonlocal looks
            looks -= 1
            if looks < 0:
                raise KeyboardInterrupt
            return receive(timeout_us)

        self.host.receive_stamped = receive_stamped  # type: ignore[method-assign]


def test_a_transfer_that_was_interrupted_is_aborted() -> None:
    bench = Interrupted(make_epos(5))
    bench.press_after(1)
    with pytest.raises(KeyboardInterrupt):
        bench.bus.read(5, 0x1008, 0x00)
    del bench.host.receive_stamped
    bench.bus.gather(WAIT_US)
    assert bench.frames[-3:-1] == ["605#4008100000000000", "605#8008100000000008"]


def test_who_is_silent_is_told_so_and_the_next_one_is_heard() -> None:
    bench = NetBench(make_epos(5))
    with pytest.raises(SdoTimeout):
        bench.bus.read(6, 0x1000, 0)
    assert bench.bus.read(5, 0x1000, 0) == bytes.fromhex("92010200")


def test_a_scan_finds_all_and_changes_nothing() -> None:
    bench = NetBench(make_epos(5), make_f_palette(16), make_f_palette(255))
    scan = NetworkScan(bench.bus, WAIT_US)
    drive, module = scan.run()
    assert (drive.node_id, drive.device_type, drive.name) == (5, 0x20192, "EPOS")
    assert (module.node_id, module.identity) == (16, (0, 1, 0x10000, 1))
    assert scan.unconfigured
    downloads = [text for text in bench.frames if text[:1] == "6" and text[4] == "2"]
    assert downloads == []


def test_two_nodes_with_one_node_id_are_seen() -> None:
    bench = NetBench(make_epos(5), make_f_palette(5))
    (found,) = NetworkScan(bench.bus, WAIT_US).run()
    assert (found.node_id, found.answers) == (5, 2)


def test_who_is_only_heard_is_listed() -> None:
    slave = make_epos(5)
    slave.dictionary[0x1017, 0].value = 10
    bench = NetBench(slave)
    bench.bus.write(5, 0x1017, 0, b"\x0a\0")
    bench.bus.command(NmtCommand.STOP, 5)
    (found,) = NetworkScan(bench.bus, WAIT_US).run()
    assert (found.node_id, found.answers, found.state) == (5, 0, NmtState.STOPPED)
