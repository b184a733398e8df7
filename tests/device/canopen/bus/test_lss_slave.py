from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.device.canopen.objects import array, booted, make_bus, read, u32
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.slave import UNCONFIGURED, Nonvolatile
from tickrig.wire.canopen.lss import FastScan, LssAddress
from tickrig.wire.canopen.nmt import NmtState

ADDRESS = LssAddress(0xAB01, 2, 0x3_0004, 0x5678)
CONFIGURE = "7E5#0401000000000000"
WAIT = "7E5#0400000000000000"
STORE = "7E5#1700000000000000"
NODE_ID = "7E5#5E00000000000000"
NODE_ID_IS_5 = "7E4#5E05000000000000"
TO_16 = "7E5#1110000000000000"
IDENTIFIED = "7E4#4F00000000000000"


def make(kept: Nonvolatile | None = None) -> Bus:
    return booted(array(0x1018, *ADDRESS), u32(0x1014, 0x80, relative=True), kept=kept)


def unconfigured() -> Bus:
    bus = make_bus(array(0x1018, *ADDRESS), u32(0x1014, 0x80, relative=True), node_id=UNCONFIGURED)
    assert bus.step() == []
    return bus


def test_in_waiting_nothing_is_inquired_or_configured() -> None:
    assert make().step(NODE_ID, TO_16, STORE) == []


def test_inquire_answers_address_and_node_id() -> None:
    bus = make()
    assert bus.step(CONFIGURE) == []
    asked = [f"7E5#5{digit}00000000000000" for digit in "ABCDE"]
    assert [bus.step(text) for text in asked] == [
        ["7E4#5A01AB0000000000"],
        ["7E4#5B02000000000000"],
        ["7E4#5C04000300000000"],
        ["7E4#5D78560000000000"],
        [NODE_ID_IS_5],
    ]


def test_switch_global_goes_back_to_waiting() -> None:
    bus = make()
    assert bus.step(CONFIGURE, NODE_ID) == [NODE_ID_IS_5]
    assert bus.step("7E5#0402000000000000", NODE_ID) == [NODE_ID_IS_5]
    assert bus.step(WAIT, NODE_ID) == []


def selective(serial: int) -> list[str]:
    return [
        "7E5#4001AB0000000000",
        "7E5#4102000000000000",
        "7E5#4204000300000000",
        f"7E5#43{serial.to_bytes(4, 'little').hex()}000000",
    ]


def test_switch_selective_needs_the_whole_address() -> None:
    bus = make()
    assert bus.step(*selective(0x5679), NODE_ID) == []
    assert bus.step(*selective(0x5678)[1:], NODE_ID) == []
    assert bus.step(*selective(0x5678), NODE_ID) == ["7E4#4400000000000000", NODE_ID_IS_5]
    assert bus.step(*selective(0x5678)) == []


def test_a_wrong_part_cannot_be_made_good_later() -> None:
    bus = make()
    messages = selective(0x5678)
    messages.insert(1, "7E5#4103000000000000")
    assert bus.step(*messages) == []


def identify(revision: tuple[int, int], serial: tuple[int, int]) -> Iterator[str]:
    for specifier, number in zip(range(0x46, 0x4C), (0xAB01, 2, *revision, *serial), strict=True):
        yield f"7E5#{specifier:02X}{number.to_bytes(4, 'little').hex()}000000"


@pytest.mark.parametrize(
    ("revision", "serial", "answered"),
    [
        ((0x3_0000, 0x3_FFFF), (0, 0xFFFF), True),
        ((0x3_0004, 0x3_0004), (0x5678, 0x5678), True),
        ((0x3_0005, 0x3_FFFF), (0, 0xFFFF), False),
        ((0x3_0000, 0x3_0003), (0, 0xFFFF), False),
        ((0x3_0000, 0x3_FFFF), (0x5679, 0xFFFF), False),
        ((0x3_0000, 0x3_FFFF), (0, 0x5677), False),
    ],
)
def test_identify_remote_slave_asks_for_a_range(
    revision: tuple[int, int], serial: tuple[int, int], answered: bool
) -> None:
    bus = make()
    assert bus.step(*identify(revision, serial)) == [IDENTIFIED] * answered
    assert bus.step(NODE_ID) == []
    bus.step(CONFIGURE)
    assert bus.step(*identify(revision, serial)) == [IDENTIFIED] * answered


def test_a_node_id_counts_from_reset_communication() -> None:
    bus = make()
    assert bus.step(CONFIGURE, TO_16) == ["7E4#1100000000000000"]
    assert bus.step(NODE_ID) == [NODE_ID_IS_5]
    assert bus.run(20) == []
    assert bus.step("000#8205") == ["710#00"]
    assert read(bus, 0x1014) == 0x90
    assert bus.step("000#8210") == ["710#00"]


def test_a_node_id_that_was_not_stored_is_lost_with_the_power() -> None:
    bus = make()
    bus.step(CONFIGURE, TO_16)
    bus.slave.reset()
    assert bus.step() == ["705#00"]


def test_a_node_id_that_was_stored_counts_from_power_on() -> None:
    bus = make()
    assert bus.step(CONFIGURE, TO_16, STORE)[1:] == ["7E4#1700000000000000"]
    assert bus.slave.nonvolatile.version == 1
    bus.slave.reset()
    assert bus.step() == ["710#00"]


@pytest.mark.parametrize("node_id", [0, 128, 254])
def test_an_impossible_node_id_is_error_1(node_id: int) -> None:
    bus = make()
    bus.step(CONFIGURE)
    assert bus.step(f"7E5#11{node_id:02X}000000000000") == ["7E4#1101000000000000"]
    assert bus.slave.pending_id == 5


def test_a_slave_can_be_made_unconfigured() -> None:
    bus = make()
    assert bus.step(CONFIGURE, "7E5#11FF000000000000") == ["7E4#1100000000000000"]
    assert bus.step("000#8205") == []
    assert bus.slave.state is NmtState.INITIALISING
    assert bus.step("7E5#4C00000000000000") == ["7E4#5000000000000000"]


@pytest.mark.parametrize(
    ("table", "index", "error"),
    [(0, 0, 0), (0, 2, 0), (0, 8, 0), (0, 5, 1), (0, 9, 1), (0, 10, 1), (1, 2, 1), (128, 2, 1)],
)
def test_the_bit_rates_of_the_standard_table_are_taken(table: int, index: int, error: int) -> None:
    bus = make()
    bus.step(CONFIGURE)
    answer = f"7E4#13{error:02X}000000000000"
    assert bus.step(f"7E5#13{table:02X}{index:02X}0000000000") == [answer]


def test_a_bit_rate_is_activated_between_two_delays() -> None:
    bus = make()
    told: list[int] = []
    bus.slave.on_bit_rate.append(told.append)
    bus.step(CONFIGURE, "7E5#1300020000000000")
    assert bus.step("7E5#150A000000000000", NODE_ID) == []
    assert bus.run(9) == []
    assert told == []
    assert bus.step(NODE_ID) == []
    assert told == [500_000]
    bus.run(9)
    assert bus.step(NODE_ID) == [NODE_ID_IS_5]
    assert told == [500_000]


def test_a_reset_does_not_stop_the_switch_of_the_bit_rate() -> None:
    bus = make()
    told: list[int] = []
    bus.slave.on_bit_rate.append(told.append)
    bus.step(CONFIGURE, "7E5#1300020000000000", "7E5#150A000000000000")
    assert bus.step("000#8205") == []
    bus.run(10)
    assert told == [500_000]


def test_a_slave_without_bit_rate_has_none_to_activate() -> None:
    bus = make()
    told: list[int] = []
    bus.slave.on_bit_rate.append(told.append)
    bus.step(CONFIGURE, "7E5#1500000000000000")
    bus.run(10)
    assert told == []


def test_a_stored_bit_rate_is_told_at_power_on() -> None:
    bus = make()
    bus.step(CONFIGURE, "7E5#1300030000000000", STORE)
    told: list[int] = []
    bus.slave.on_bit_rate.append(told.append)
    bus.slave.reset()
    bus.step()
    assert told == [250_000]


def test_lss_works_in_stopped() -> None:
    bus = make()
    bus.step("000#0205")
    assert bus.step(CONFIGURE, NODE_ID) == [NODE_ID_IS_5]


def test_any_reset_returns_to_waiting() -> None:
    bus = make()
    bus.step(CONFIGURE, "000#8105")
    assert bus.step(NODE_ID) == []


@pytest.mark.parametrize(
    "frame",
    ["7E5#", "7E5#04010000000000", "7E5#FF00000000000000", "7E5#R8", "7E4#0401000000000000"],
)
def test_what_is_no_command_is_ignored(frame: str) -> None:
    bus = make()
    assert bus.step(frame, NODE_ID) == []


def test_without_a_whole_identity_there_is_no_lss() -> None:
    bus = booted(array(0x1018, 1, 2, 3))
    assert bus.step(CONFIGURE, NODE_ID) == []


def test_an_unconfigured_slave_does_not_boot() -> None:
    bus = unconfigured()
    assert bus.run(100) == []
    assert bus.step("000#0100", "000#8200") == []
    assert bus.step("7E5#4C00000000000000") == ["7E4#5000000000000000"]
    assert bus.step(CONFIGURE, NODE_ID) == ["7E4#5EFF000000000000"]


def test_an_unconfigured_slave_boots_when_it_has_a_node_id_and_waits() -> None:
    bus = unconfigured()
    assert bus.step(CONFIGURE, TO_16) == ["7E4#1100000000000000"]
    assert bus.step("7E5#4C00000000000000") == []
    assert bus.step(WAIT) == ["710#00"]
    assert bus.slave.state is NmtState.PRE_OPERATIONAL
    assert read(bus, 0x1014) == 0x90


def test_an_unconfigured_slave_without_a_node_id_goes_on_waiting() -> None:
    bus = unconfigured()
    assert bus.step(CONFIGURE, WAIT) == []
    assert bus.slave.state is NmtState.INITIALISING


def scan(bus: Bus, *request: int) -> bool:
    answer = bus.step(f"7E5#{FastScan(*request).encode().hex()}")
    assert answer in ([], [IDENTIFIED])
    return bool(answer)


def fastscan(bus: Bus) -> list[int]:
    """Search as a master does; raise AssertionError if nobody answers."""
    assert scan(bus, 0, 0x80, 0, 0)
    found = []
    for sub in range(4):
        number = 0
        for bit in reversed(range(32)):
            if not scan(bus, number, bit, sub, sub):
                number |= 1 << bit
        assert scan(bus, number, 0, sub, (sub + 1) % 4)
        found.append(number)
    return found


def test_fastscan_finds_an_unconfigured_slave_and_configures_it() -> None:
    bus = unconfigured()
    assert fastscan(bus) == list(ADDRESS)
    assert bus.step(NODE_ID) == ["7E4#5EFF000000000000"]
    assert bus.step("7E5#5100000000800000") == []


def test_a_configured_slave_ignores_fastscan() -> None:
    bus = make()
    assert bus.step("7E5#5100000000800000", "7E5#4C00000000000000") == []


@pytest.mark.parametrize(
    "request_",
    [
        (0xAB01, 32, 0, 0),  # no such bit
        (2, 0, 1, 2),  # not the part that is asked for now
        (0xAB00, 0, 0, 1),  # another number
        (0xAB01, 0, 0, 4),  # no such part
    ],
)
def test_a_fastscan_request_that_does_not_fit_is_not_answered(request_: tuple[int, ...]) -> None:
    bus = unconfigured()
    scan(bus, 0, 0x80, 0, 0)
    assert not scan(bus, *request_)


def test_a_fastscan_can_begin_anew() -> None:
    bus = unconfigured()
    scan(bus, 0, 0x80, 0, 0)
    assert scan(bus, 0xAB01, 0, 0, 1)
    assert fastscan(bus) == list(ADDRESS)
