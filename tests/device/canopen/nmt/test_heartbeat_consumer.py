from __future__ import annotations

import pytest

from tests.device.canopen.objects import array, booted, errors, u16, write
from tickrig.device.canopen.nmt import HeartbeatConsumer, Watch
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

NODE_7_200_MS = 0x0007_00C8
LOST = "085#3081110700000000"
BACK = "085#0000000700000000"


def test_nothing_is_late_before_the_first_heartbeat() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    assert bus.run(500) == []


def test_a_heartbeat_that_does_not_come_is_told_after_the_time() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    bus.step("707#7F")
    assert bus.run(199) == []
    assert bus.step() == [LOST]
    assert bus.run(500) == []


def test_a_boot_up_message_counts_as_the_first_heartbeat() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    bus.step("707#00")
    assert bus.run(200) == [LOST]


def test_heartbeats_in_time_are_no_error() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    for _ in range(10):
        assert bus.step("707#05") == []
        assert bus.run(199) == []


def test_the_error_is_cleared_when_the_heartbeat_is_back() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    bus.step("707#05")
    assert bus.run(300) == [LOST]
    assert bus.step("707#05") == [BACK]
    assert bus.run(199) == []
    assert bus.step() == [LOST]


def test_each_node_has_its_own_error() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS, 0x0008_0064))
    bus.step("707#05", "708#05")
    assert bus.run(100) == ["085#3081110800000000"]
    assert bus.run(100) == [LOST]
    assert bus.step("707#05") == ["085#0000110700000000"]
    assert bus.step("708#05") == ["085#0000000800000000"]


def test_the_state_of_a_node_is_known() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    monitor = HeartbeatConsumer.of(bus.slave).monitors[1]
    assert (monitor.watch, monitor.nmt_state) == (Watch.UNKNOWN, None)
    bus.step("707#05")
    assert (monitor.watch, monitor.nmt_state) == (Watch.ALIVE, NmtState.OPERATIONAL)
    bus.run(300)
    assert monitor.watch is Watch.LOST


def test_what_is_no_heartbeat_is_ignored() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    bus.step("707#", "707#0505", "707#R1", "706#05")
    assert bus.run(300) == []


def test_heartbeats_are_watched_in_stopped_and_told_afterwards() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    bus.step("000#0205")
    bus.step("707#05")
    assert bus.run(300) == []
    assert bus.step("000#8005") == [LOST]


def test_a_write_begins_to_watch() -> None:
    bus = booted(errors(), array(0x1016, 0))
    assert bus.step("707#05") == []
    assert write(bus, 0x1016, NODE_7_200_MS, 1) is None
    assert bus.run(300) == []
    bus.step("707#05")
    assert bus.run(200) == [LOST]


def test_an_entry_that_is_changed_ends_its_error() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    bus.step("707#05")
    assert bus.run(200) == [LOST]
    assert write(bus, 0x1016, 0, 1) is None
    assert bus.step("707#05") == [BACK]
    assert bus.run(300) == []


@pytest.mark.parametrize(("node_id", "lost"), [(0, 0), (1, 1), (127, 1), (128, 0)])
def test_the_first_and_the_last_node_id_are_watched(node_id: int, lost: int) -> None:
    bus = booted(errors(), array(0x1016, node_id << 16 | 200))
    bus.step(f"{0x700 + node_id:03X}#05")
    assert bus.run(300) == [f"085#308111{node_id:02X}00000000"] * lost


@pytest.mark.parametrize("time_ms", [1, 0xFFFF])
def test_the_shortest_and_the_longest_time_can_be_set(time_ms: int) -> None:
    bus = booted(errors(), array(0x1016, 0))
    assert write(bus, 0x1016, 7 << 16 | time_ms, 1) is None
    bus.step("707#05")
    assert bus.slave.due_us == bus.now_us + 1_000 * time_ms


def test_a_reset_forgets_what_was_watched_since_power_on() -> None:
    bus = booted(errors(), array(0x1016, 0))
    write(bus, 0x1016, NODE_7_200_MS, 1)
    bus.step("000#8205")
    assert not HeartbeatConsumer.of(bus.slave).monitors


def test_an_entry_that_is_switched_off_ends_the_wait() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    bus.step("707#05")
    write(bus, 0x1016, 0, 1)
    assert bus.slave.due_us == NEVER


@pytest.mark.parametrize(
    ("value", "refused"),
    [
        (0x0007_012C, AbortCode.PARAMETER_INCOMPATIBLE),
        (0x0007_0000, None),
        (0x0008_012C, None),
        (0x0000_012C, None),
        (0x0080_012C, None),
    ],
)
def test_a_node_is_watched_once(value: int, refused: AbortCode | None) -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS, 0))
    assert write(bus, 0x1016, value, 2) is refused
    assert write(bus, 0x1016, 0x0007_0064, 1) is None


def test_a_reset_watches_the_power_on_values() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS))
    write(bus, 0x1016, 0x0008_0064, 1)
    bus.step("707#05", "708#05")
    assert bus.step("000#8205") == ["705#00"]
    assert bus.run(300) == []
    bus.step("707#05")
    assert bus.run(200) == [LOST]


def test_the_own_heartbeat_carries_the_new_state_at_once() -> None:
    bus = booted(errors(), array(0x1016, NODE_7_200_MS), u16(0x1017, 100))
    bus.run(99)
    assert bus.step("000#0105", "707#05") == ["705#05"]
    assert bus.run(200) == ["705#05", LOST, "705#7F"]


def test_reserved_bits_are_refused() -> None:
    bus = booted(errors(), array(0x1016, 0))
    for bit in range(24, 32):
        assert write(bus, 0x1016, NODE_7_200_MS | 1 << bit, 1) == AbortCode.VALUE_RANGE
    assert bus.slave.dictionary[0x1016, 1].number == 0
