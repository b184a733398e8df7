from __future__ import annotations

from itertools import pairwise, product
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.errors import FieldError
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import PS_PER_S, Character, Parity, UartReceiver, UartSetting, sample

EVERY_BYTE = bytes(range(256))
PARITIES: tuple[Parity, ...] = get_args(Parity)
FRAMES = list(product((5, 6, 7, 8), PARITIES, (1, 1.5, 2)))
SLOW = UartSetting(1_000_000)  # a bit is 1 us, its samples 62.5 ns apart

settings = st.builds(
    UartSetting,
    st.integers(50, 4_000_000),
    st.sampled_from((5, 6, 7, 8)),
    st.sampled_from(PARITIES),
    st.sampled_from((1, 1.5, 2)),
)


def values(characters: tuple[Character, ...]) -> bytes:
    return bytes(character.value for character in characters)


def errors(characters: tuple[Character, ...]) -> list[tuple[bool, bool]]:
    return [(got.framing_error, got.parity_error) for got in characters]


@pytest.mark.parametrize(
    ("setting", "bits"),
    [
        (UartSetting(), "1000 1000"),
        (UartSetting(data_bits=7), "1000 100"),
        (UartSetting(parity="E"), "1000 1000 0"),
        (UartSetting(parity="O"), "1000 1000 1"),
        (UartSetting(parity="M"), "1000 1000 1"),
        (UartSetting(parity="S"), "1000 1000 0"),
    ],
    ids=str,
)
def test_a_character_is_sent_the_lowest_bit_first(setting: UartSetting, bits: str) -> None:
    sent = "".join(map(str, setting.bits(0b0001_0001)))
    assert sent == "0" + bits.replace(" ", "")


def test_the_parity_bit_makes_the_ones_even_or_odd() -> None:
    for value in EVERY_BYTE:
        for parity, odd in (("E", 0), ("O", 1)):
            setting = UartSetting(parity=parity)  # type: ignore[arg-type]
            assert (value.bit_count() + setting.parity_bit(value)) % 2 == odd
            assert setting.parity_bit(value) in (0, 1)
    assert [UartSetting(parity=parity).parity_bit(1) for parity in PARITIES] == [1, 1, 0, 1, 0]


def test_a_setting_is_written_as_people_do() -> None:
    assert [str(UartSetting(1, 5, "M", 1.5)), str(UartSetting())] == ["1 5M1.5", "115200 8N1"]


def test_a_line_has_the_levels_of_its_bits() -> None:
    setting = UartSetting(1_000_000, 5, "E", 2)
    levels = list(setting.levels(0b00001, 5_000_000))
    assert levels[:3] == [(0, 6_000_000), (1, 7_000_000), (0, 8_000_000)]
    assert levels[-2:] == [(1, 12_000_000), (1, 14_000_000)]  # parity, stop bits
    assert (setting.frame_bits, setting.duration_ps(2)) == (9, 18_000_000)
    assert UartSetting(1_000_000, 5, "N", 1.5).duration_ps(3) == 22_500_000


@pytest.mark.unmeasured
@pytest.mark.parametrize(("data_bits", "parity", "stop_bits"), FRAMES)
def test_equal_settings_understand_each_other(
    data_bits: int, parity: Parity, stop_bits: float
) -> None:
    setting = UartSetting(115_200, data_bits, parity, stop_bits)
    received = sample(EVERY_BYTE, setting, setting)
    assert values(received) == bytes(value % (1 << data_bits) for value in EVERY_BYTE)
    assert set(errors(received)) == {(False, False)}


@given(settings, st.binary(max_size=20), st.integers(0, 2 * PS_PER_S))
def test_at_any_rate_and_time(setting: UartSetting, data: bytes, start_ps: int) -> None:
    received = sample(data, setting, setting, start_ps)
    assert values(received) == bytes(value % (1 << setting.data_bits) for value in data)
    assert set(errors(received)) <= {(False, False)}
    for count, character in enumerate(received, start=1):
        late_ps = character.end_ps - start_ps - setting.duration_ps(count)
        stops_ps = int(2 * setting.stop_bits - 2) * PS_PER_S // (2 * setting.baud)
        assert -2 <= late_ps + stops_ps <= PS_PER_S // (16 * setting.baud) + 2  # a sample


@given(settings, settings, st.binary(max_size=20))
def test_any_settings_give_characters_in_order(
    sender: UartSetting, receiver: UartSetting, data: bytes
) -> None:
    received = sample(data, sender, receiver)
    frame_ps = receiver.duration_ps() - int(receiver.stop_bits * PS_PER_S / receiver.baud)
    for before, after in pairwise(received):
        assert after.end_ps - before.end_ps >= frame_ps
    for character in received:
        assert 0 <= character.value < 1 << receiver.data_bits
        assert character.framing_error or not character.line_break
    assert len(received) <= 1 + len(data) * sender.duration_ps() // frame_ps


@pytest.mark.unmeasured
@given(settings, settings, st.binary(max_size=8), st.lists(st.integers(1, 10**9), max_size=30))
def test_levels_may_come_in_any_pieces(
    sender: UartSetting, receiver: UartSetting, data: bytes, cuts: list[int]
) -> None:
    uart, pieces = UartReceiver(receiver), iter(cuts)
    received, start_ps, now_ps = list[Character](), 0, 0
    for value in data:
        for level, until_ps in sender.levels(value, start_ps):
            while (cut_ps := now_ps + next(pieces, 10**13)) < until_ps:
                received += uart.push(level, now_ps := cut_ps)
            received += uart.push(level, now_ps := until_ps)
        start_ps += sender.duration_ps()
    received += uart.push(1, start_ps + receiver.duration_ps(2))
    assert tuple(received) == sample(data, sender, receiver)


@pytest.mark.parametrize("permille", [-40, -20, -10, 10, 20, 40])
def test_rates_within_four_percent_understand_each_other(permille: int) -> None:
    receiver = UartSetting(1_000_000 + 1_000 * permille)
    received = sample(EVERY_BYTE, SLOW, receiver)
    assert values(received) == EVERY_BYTE
    assert set(errors(received)) == {(False, False)}


@pytest.mark.parametrize("permille", [-60, 60])
def test_rates_six_percent_apart_do_not(permille: int) -> None:
    received = sample(EVERY_BYTE, SLOW, UartSetting(1_000_000 + 1_000 * permille))
    assert any(character.framing_error for character in received)


def test_a_receiver_of_twice_the_rate_sees_each_bit_twice() -> None:
    received = sample(b"\x55", SLOW, UartSetting(2_000_000))
    # 0 0 11001100 1, then the low bits that are left
    assert values(received[:1]) == b"\x66"


def test_without_the_parity_bit_that_it_sends_it_is_a_stop_bit() -> None:
    sender = UartSetting(parity="E")
    received = sample(EVERY_BYTE, sender, UartSetting())
    alone = [sample(bytes([value]), sender, UartSetting()) for value in EVERY_BYTE]
    assert [values(got) for got in alone] == [bytes([value]) for value in EVERY_BYTE]
    even = [value.bit_count() % 2 == 0 for value in EVERY_BYTE]
    assert [got[0].framing_error for got in alone] == even
    assert len(received) == 256


def test_with_a_parity_bit_that_is_not_sent_half_of_all_bytes_are_wrong() -> None:
    alone = [sample(bytes([value]), UartSetting(), UartSetting(parity="E")) for value in EVERY_BYTE]
    assert [values(got) for got in alone] == [bytes([value]) for value in EVERY_BYTE]
    odd = [value.bit_count() % 2 == 1 for value in EVERY_BYTE]
    assert [not got[0].parity_error for got in alone] == odd
    assert not any(got[0].framing_error for got in alone)


@pytest.mark.unmeasured
@pytest.mark.parametrize("wanted", PARITIES)
@pytest.mark.parametrize("sent", PARITIES)
def test_a_parity_error_is_a_bit_that_is_not_the_one_expected(sent: Parity, wanted: Parity) -> None:
    if "N" in (sent, wanted):
        return
    sender, receiver = UartSetting(parity=sent), UartSetting(parity=wanted)
    received = sample(EVERY_BYTE, sender, receiver)
    assert values(received) == EVERY_BYTE
    assert [got.parity_error for got in received] == [
        sender.parity_bit(value) != receiver.parity_bit(value) for value in EVERY_BYTE
    ]


def test_one_or_two_stop_bits_make_no_difference_to_a_receiver() -> None:
    settings = [UartSetting(stop_bits=stop_bits) for stop_bits in (1, 1.5, 2)]
    for sender, receiver in product(settings, repeat=2):
        received = sample(EVERY_BYTE, sender, receiver)
        assert values(received) == EVERY_BYTE
        assert set(errors(received)) == {(False, False)}


def test_a_break_is_one_character_however_long_it_is() -> None:
    uart = UartReceiver(SLOW)
    assert list(uart.push(1, 5_000_000)) == []
    (received,) = uart.push(0, 500_000_000)
    assert received == Character(0, 15_000_000, framing_error=True, line_break=True)
    assert list(uart.push(1, 501_000_000)) == []
    received = next(iter(uart.push(0, 502_000_000)), None) or next(uart.push(1, 600_000_000))
    assert received == Character(0xFF, 511_000_000)


def test_a_break_that_ends_with_its_start_bit_is_a_character() -> None:
    uart = UartReceiver(SLOW)
    assert list(uart.push(0, 1_000_000)) == []
    assert [got.value for got in uart.push(1, 10_000_000)] == [0xFF]


@pytest.mark.parametrize("length_ps", [10_000, 300_000, 499_000])
def test_a_start_bit_that_is_gone_in_its_middle_was_none(length_ps: int) -> None:
    uart = UartReceiver(SLOW)
    assert list(uart.push(1, 1_000_001)) == []
    assert list(uart.push(0, 1_000_001 + length_ps)) == []
    assert list(uart.push(1, 100_000_000)) == []
    assert uart.due_ps == NEVER


def test_due_is_when_the_stop_bit_is_sampled() -> None:
    uart = UartReceiver(SLOW)
    assert uart.due_ps == NEVER
    assert list(uart.push(0, 1_000_000)) == []
    assert uart.due_ps == 9_500_000
    assert list(uart.push(1, 9_500_000)) == []
    assert [got.value for got in uart.push(1, 9_500_001)] == [0xFF]


def test_a_time_that_has_passed_is_looked_at_no_more() -> None:
    uart = UartReceiver(SLOW, now_ps=100_000_000)
    assert list(uart.push(0, 50_000_000)) == []
    assert uart.due_ps == NEVER
    assert [got.value for got in uart.push(0, 101_000_000)] == []
    assert uart.due_ps == 109_500_000


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"baud": 0}, "0 bit/s: a UART has at least 1"),
    ({"data_bits": 9}, "9 data bits: a UART has 5, 6, 7 or 8"),
    ({"parity": "X"}, "parity 'X': a UART has N, E, O, M or S"),
    ({"stop_bits": 3}, "3 stop bits: a UART has 1, 1.5 or 2"),
]


@pytest.mark.parametrize(("values", "told"), WRONG)
def test_a_setting_that_no_uart_has_is_refused(values: dict[str, Any], told: str) -> None:
    with pytest.raises(FieldError, match=told.replace(".", r"\.")):
        UartSetting(**values)
