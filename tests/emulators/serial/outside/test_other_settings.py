"""Hosts whose setting is not that of the device: what each end makes of the other's bits."""

from __future__ import annotations

import copy
import logging
from typing import get_args

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.echo import Echo
from tests.emulators.serial.outside.lines import BAUD, SETTING, OpenLine, rig_of
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.outside.serial_side import SerialSide, UartErrors
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.wire.uart import PS_PER_US, Character, Parity, UartSetting, sample

EVERY_BYTE = bytes(range(256))

settings = st.builds(
    UartSetting,
    st.sampled_from([9_600, 50_000, 57_600, 96_000, BAUD, 115_200, 200_000, 1_000_000]),
    st.sampled_from((5, 6, 7, 8)),
    st.sampled_from(get_args(Parity)),
    st.sampled_from((1, 1.5, 2)),
)


def values(characters: tuple[Character, ...]) -> bytes:
    return bytes(character.value for character in characters)


def errors(characters: tuple[Character, ...]) -> UartErrors:
    counted = UartErrors()
    for character in characters:
        counted.count(character)
    return counted


def line_of(setting: UartSetting, **options: object) -> OpenLine:
    frame = {"bytesize": setting.data_bits, "parity": setting.parity, "stopbits": setting.stop_bits}
    return OpenLine(baudrate=setting.baud, **frame, **options)


def arrivals(bench: OpenLine, until_us: int) -> list[tuple[int, int]]:
    """Return what arrives at the device, byte by byte, with the times."""
    arrived = list[tuple[int, int]]()
    while bench.rig.now_us < until_us:
        bench.rig.run_to(min(until_us, bench.rig.next_us, bench.far.due_us))
        arrived += [(bench.rig.now_us, value) for value in bench.heard()]
    return arrived


@given(settings.filter(lambda setting: setting != SETTING), st.binary(max_size=20))
def test_a_device_receives_what_its_uart_samples(setting: UartSetting, data: bytes) -> None:
    bench = line_of(setting)
    bench.port.write(data)
    wanted = sample(data, setting, SETTING)
    bench.rig.run_for(1)  # who makes time pass makes no difference
    bench.port.flush()
    bench.rig.run_for(1_000)
    assert bench.far.poll(bench.rig.now_us) == values(wanted)
    assert bench.side.transmitter.errors == errors(wanted)


@given(settings.filter(lambda setting: setting != SETTING), st.binary(max_size=20))
def test_a_device_receives_each_byte_when_its_last_bit_has_passed(
    setting: UartSetting, data: bytes
) -> None:
    bench = line_of(setting)
    bench.port.write(data)
    wanted = sample(data, setting, SETTING)
    arrived = arrivals(bench, 200_000 + 20 * 1_200)
    assert [value for _, value in arrived] == list(values(wanted))
    for (at_us, _), character in zip(arrived, wanted, strict=True):
        # noise may be denser than a line carries; a character waits a fraction of a bit then
        assert -1 <= at_us - character.end_ps / PS_PER_US <= 60


@given(settings.filter(lambda setting: setting != SETTING), st.binary(max_size=20), st.booleans())
def test_a_host_receives_what_its_uart_samples(
    setting: UartSetting, data: bytes, late: bool
) -> None:
    bench = line_of(setting, timeout=0.05)
    bench.far.send(0, data)
    wanted = sample(data, SETTING, setting)
    if late:
        bench.rig.run_for(50_000)
    assert bench.port.read(100) == values(wanted)
    assert bench.side.receiver.errors == errors(wanted)
    assert bench.side.transmitter.errors == UartErrors()


def test_a_host_of_half_the_rate_reads_noise() -> None:
    bench = OpenLine(baudrate=BAUD // 2, timeout=0.01)
    bench.far.send(0, b"OK\n")
    assert bench.port.read(10) == b"\x8c\xfe"


def test_two_stop_bits_are_understood_and_take_their_time() -> None:
    bench = OpenLine(stopbits=2)
    bench.port.write(b"0123456789")
    bench.port.flush()
    assert (bench.rig.now_us, bench.heard()) == (1_100, b"0123456789")
    assert bench.side.transmitter.errors == UartErrors()


def test_bytes_with_a_parity_that_the_device_has_not_arrive_with_framing_errors() -> None:
    bench = OpenLine(parity="E")
    for value in EVERY_BYTE:
        bench.port.write(bytes([value]))
        bench.port.flush()
        bench.rig.run_for(1_000)
    assert bench.heard() == EVERY_BYTE
    errors = bench.side.transmitter.errors
    assert (errors.framing, errors.parity, errors.breaks) == (127, 0, 1)


def test_a_host_that_expects_a_parity_bit_counts_errors_and_reads_the_bytes() -> None:
    bench = OpenLine(parity="E", timeout=0.01)
    for number, value in enumerate(EVERY_BYTE):
        bench.at(10_000 * number, bytes([value]))
    bench.rig.run_for(3_000_000)
    assert bench.port.read_all() == EVERY_BYTE
    assert bench.side.receiver.errors == UartErrors(parity=128)


def test_seven_bits_are_seven_bits() -> None:
    bench = OpenLine(bytesize=7, timeout=0.01)
    bench.far.send(0, b"\x41")  # bit 7 of it is no stop bit
    assert (bench.port.read(), bench.side.receiver.errors) == (b"\x41", UartErrors(framing=1))
    bench.port.write(b"\x41")
    bench.port.flush()
    bench.rig.run_for(100)
    assert bench.heard() == b"\xc1"  # the stop bit is bit 7


def test_a_host_finds_the_rate_of_its_device() -> None:
    bench = OpenLine(timeout=0.05)
    bench.port.close()
    found = []
    with bench.port as port:
        for baud in (9_600, 57_600, BAUD, 115_200):
            port.baudrate = baud
            port.reset_input_buffer()
            bench.far.send(bench.rig.now_us, b"ping")
            if port.read(4) == b"ping":
                found.append(baud)
    assert found == [BAUD]


def test_a_change_of_the_rate_loses_nothing_that_has_come() -> None:
    bench = OpenLine(timeout=0.01)
    bench.far.send(0, b"ab")
    bench.rig.run_for(1_000)
    bench.port.baudrate = 9_600
    bench.port.baudrate = BAUD
    bench.far.send(bench.rig.now_us, b"cd")
    assert bench.port.read(4) == b"abcd"


def test_what_was_written_before_a_change_of_the_rate_goes_before_it() -> None:
    bench = OpenLine()
    bench.port.write(b"0123456789")
    bench.port.stopbits = 2
    bench.port.write(b"abc")
    bench.port.stopbits = 1
    bench.port.write(b"def")
    bench.port.flush()
    assert (bench.rig.now_us, bench.port.out_waiting) == (1_630, 0)
    bench.rig.run_for(100)
    assert bench.heard() == b"0123456789abcdef"
    bench.port.write(b"x")
    bench.port.flush()
    assert bench.heard() == b"x"


def test_a_break_is_a_byte_of_0_and_is_counted() -> None:
    bench = OpenLine()
    bench.port.write(b"ab")
    bench.port.send_break(0.01)
    assert bench.rig.now_us == 200 + 10_000
    bench.port.write(b"cd")
    bench.port.flush()
    bench.rig.run_for(100)
    assert bench.heard() == b"ab\0cd"
    assert bench.side.transmitter.errors == UartErrors(breaks=1)


def test_a_break_is_there_when_a_character_has_passed() -> None:
    bench = OpenLine()
    bench.port.break_condition = True
    assert bench.port.break_condition
    assert arrivals(bench, 10_000) == [(100, 0)]
    bench.port.write(b"nobody hears it")
    bench.port.flush()
    bench.port.break_condition = False
    bench.rig.run_for(1_000)
    assert bench.heard() == b""
    assert bench.side.transmitter.errors == UartErrors(breaks=1)


def test_a_break_that_is_shorter_than_a_character_is_a_character() -> None:
    bench = OpenLine()
    bench.port.send_break(0.000_055)  # start bit and 4 or 5 bits of 0
    bench.rig.run_for(1_000)
    assert bench.heard() in (b"\xf0", b"\xe0")
    assert bench.side.transmitter.errors == UartErrors()


def test_a_break_ends_when_the_port_is_closed() -> None:
    bench = OpenLine()
    bench.port.break_condition = True
    bench.rig.run_for(1_000)
    bench.port.close()
    bench.rig.run_for(1_000)
    with SimSerial(bench.side) as port:
        port.write(b"x")
        port.flush()
        bench.rig.run_for(100)
    assert bench.heard() == b"\0x"


def test_noise_that_has_not_begun_can_be_taken_back() -> None:
    bench = OpenLine(stopbits=2)
    bench.port.write(b"0123456789")
    bench.rig.run_for(250)
    assert bench.port.out_waiting == 8
    bench.port.reset_output_buffer()
    assert bench.port.out_waiting == 1
    bench.port.write(b"x")
    bench.port.flush()
    bench.rig.run_for(100)
    assert (bench.rig.now_us, bench.heard()) == (540, b"012x")


def test_a_long_write_at_another_setting_waits_for_room() -> None:
    bench = OpenLine(stopbits=2, buffer_bytes=100)
    assert bench.port.write(bytes(150)) == 150
    assert 5_400 <= bench.rig.now_us <= 5_610
    heard = bench.heard()
    bench.port.flush()
    bench.rig.run_for(100)
    assert heard + bench.heard() == bytes(150)


def test_a_device_without_a_uart_understands_every_setting() -> None:
    bench = OpenLine(device=None, baudrate=300, parity="E", timeout=0.01)
    bench.port.write(b"ab")
    bench.far.send(0, b"cd")
    assert bench.port.read(2) == b"cd"
    bench.port.send_break(0.1)
    assert (bench.heard(), bench.side.transmitter.errors) == (b"ab", UartErrors())


def test_a_setting_that_differs_can_be_refused() -> None:
    bench = OpenLine(mismatch="refuse")
    with pytest.raises(serial.SerialException, match="rig is set to 9600 8N1, the device has 1000"):
        bench.port.baudrate = 9_600
    bench.port.close()
    with pytest.raises(serial.SerialException, match="rig is set to 100000 8E1, the device has 10"):
        SimSerial(bench.side, parity="E")
    assert not bench.side.in_use
    with pytest.raises(ValueError, match="mismatch 'loud': 'errors' or 'refuse'"):
        OpenLine(mismatch="loud")


def test_a_setting_that_differs_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        bench = OpenLine(baudrate=9_600)
        bench.port.timeout = 3
        bench.port.baudrate = BAUD
    (record,) = caplog.records
    assert record.getMessage() == (
        "rig is set to 9600 8N1, the device has 100000 8N1: each samples what the other sends,"
        " perhaps wrongly"
    )


def test_a_host_on_rs485_is_sampled_too() -> None:
    line = Rs485Line(BAUD)
    rig = Rig(Station(Echo(tick_us=1_000), line.a))
    port = SimSerial(SerialSide(rig, line.b, SETTING), stopbits=2, timeout=0.01)
    port.write(b"hello")
    assert port.read(5) == b"hello"
    port.write(b"0123456789")
    rig.run_for(250)
    port.reset_output_buffer()
    assert port.read(10) == b"012"


@pytest.mark.parametrize(
    "options", [{"baudrate": 9_600}, {"parity": "E"}, {"stopbits": 2}], ids=str
)
def test_a_twin_samples_as_the_original(options: dict[str, object]) -> None:
    line = Rs485Line(BAUD)
    rig = Rig(Station(Echo(tick_us=1_000), line.a))
    port = SimSerial(SerialSide(rig, line.b, SETTING), timeout=0.05, **options)
    port.write(b"to and fro")
    rig.run_for(1_234)
    twin = copy.deepcopy(port)
    assert (twin.read(100), rig_of(twin).now_us) == (port.read(100), rig.now_us)
    assert twin.side is not None
    assert port.side is not None
    assert twin.side.transmitter.errors == port.side.transmitter.errors
    assert twin.side.receiver.errors == port.side.receiver.errors
