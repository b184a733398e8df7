from __future__ import annotations

import pytest

from tests.emulators.can.can_bench import Log, frames
from tests.emulators.can.test_can_rig import Node
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import MOST_LOOKS
from tickrig.emulators.rig.station import Station
from tickrig.host.links.link import LinkClosed, LinkError, LinkTimeout
from tickrig.wire.can import frame_bits


def hosted() -> tuple[CanHost, CanWire, Node]:
    wire, node = CanWire(), Node(1, accepts=frozenset({0x80}))
    return CanHost(Rig(Station(node, wire.end())), wire.end()), wire, node


def test_time_passes_while_the_host_waits() -> None:
    host, _, _ = hosted()
    host.send(frames("080#"))
    assert host.now_us == 0
    assert host.receive(1_000_000) == frames("201#0100")
    assert host.now_us == 4_000 + frame_bits(frames("201#0100")[0]) - 3


def test_silence_lasts_exactly_the_timeout() -> None:
    host, _, _ = hosted()
    assert (host.receive(123_456), host.now_us) == ((), 123_456)
    assert (host.receive(-5), host.now_us) == ((), 123_456)


def test_frames_that_came_together_are_returned_together_or_one_by_one() -> None:
    host, wire, _ = hosted()
    other = wire.end()
    other.send(0, frames("100# 101#"))
    assert host.receive(44) == ()
    wire.advance(1_000)
    assert host.receive(0) == frames("100# 101#")
    other.send(1_000, frames("100# 101# 102#"))
    wire.advance(2_000)
    first = host.take(None)
    assert first is not None
    assert first[1:] == frames("100#")
    assert host.receive(0) == frames("101# 102#")


def test_a_frame_is_repeated_in_virtual_time_until_it_is_stopped() -> None:
    host, wire, _ = hosted()
    log = Log(wire)
    repeat = host.repeat(frames("300# 302#"), 10_000)
    host.receive(25_000)
    repeat.frames = frames("301#")
    host.receive(10_000)
    repeat.stop()
    host.receive(100_000)
    assert log.text == "300# 302# 300# 301#"
    assert [at_us // 10_000 for at_us in log.times_us] == [0, 1, 2, 3]
    with pytest.raises(ValueError, match="at least 1 frame and 1 us"):
        host.repeat(frames("300#"), 0)


def test_a_closed_link_says_so() -> None:
    host, _, _ = hosted()
    host.close()
    host.close()
    with pytest.raises(LinkClosed, match="closed"):
        host.send(())
    with pytest.raises(LinkClosed, match="closed"):
        host.receive(1)


def test_waiting_for_ever_for_nothing_is_told() -> None:
    host, _, _ = hosted()
    with pytest.raises(LinkTimeout, match="nothing will ever happen"):
        host.take(None)


@pytest.mark.parametrize("timeout_us", [0, -1])
def test_looking_for_ever_is_told(timeout_us: int) -> None:
    host, _, _ = hosted()
    for _ in range(3):
        for _ in range(MOST_LOOKS):
            assert host.receive(timeout_us) == ()
        host.receive(1)
    with pytest.raises(
        LinkError, match=r"looked 10000 times at 0\.000003 s: looking makes no time"
    ):
        all(host.receive(timeout_us) == () for _ in range(2 * MOST_LOOKS))
