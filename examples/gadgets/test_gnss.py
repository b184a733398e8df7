"""A GNSS receiver with NMEA and UBX, and hosts that change its bit rate and do not follow."""

from functools import reduce
from operator import xor
from struct import pack, unpack_from

import pytest
import serial

from tickrig import Bench, Copyable, InputSignal, OutputSignal, QuantityBank, UartSetting, by_length

SYNC = b"\xb5\x62"
CFG_PRT, ACK, NAK = b"\x06\x00", b"\x05\x01", b"\x05\x00"
UBX = by_length(SYNC, at=4, extra=8, size=2, order="little", gap="50ms")
RATES, PERIOD_US = (9_600, 38_400, 115_200), 1_000_000
INPUTS = (
    InputSignal("latitude_deg", "place", low=-90, high=90, initial=35, unit="deg", real=True),
    InputSignal("satellites", "that it sees", high=12, initial=8),
)


def nmea(text: str) -> bytes:
    return f"${text}*{reduce(xor, text.encode()):02X}\r\n".encode()


def ubx(kind: bytes, data: bytes) -> bytes:
    """Write a UBX message with its Fletcher sum."""
    body, first, second = kind + pack("<H", len(data)) + data, 0, 0
    for value in body:
        first = (first + value) & 0xFF
        second = (second + first) & 0xFF
    return SYNC + body + bytes([first, second])


class Gnss(Copyable):
    """Sends GGA each second; UBX-CFG-PRT is acknowledged, and sets the bit rate of UART 1."""

    tick_us = 1_000

    def __init__(self) -> None:
        self.inputs = QuantityBank(INPUTS)
        self.outputs = {"baud": OutputSignal("baud", "of its UART", "bit/s")}
        self.reset()

    @property
    def uart(self) -> UartSetting:
        """Its line; what a tick returns still has the setting before it."""
        return UartSetting(self._baud)

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else min(self._next_us, self._frames.due_us)

    def reset(self) -> None:
        self._baud, self._next_us, self._frames = RATES[0], PERIOD_US, UBX.splitter()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        sent = b"".join([self._answer(frame) for frame in self._frames.push(now_us, rx)])
        while now_us >= self._next_us:
            sent += self._fix(self._next_us // PERIOD_US)
            self._next_us += PERIOD_US
        return sent

    def _answer(self, frame: bytes) -> bytes:
        kind, data = frame[2:4], frame[6:-2]
        if frame[:2] != SYNC or ubx(kind, data) != frame:
            return b""
        baud = unpack_from("<I", data, 8)[0] if kind == CFG_PRT and len(data) == 20 else 0
        self._baud = baud if baud in RATES else self._baud
        return ubx(ACK if baud in RATES else NAK, kind)

    def _fix(self, second: int) -> bytes:
        latitude_deg, seen = self.inputs["latitude_deg"], int(self.inputs["satellites"])
        degrees, minutes = divmod(abs(latitude_deg) * 60, 60)
        place = f"{degrees:02.0f}{minutes:07.4f},{'NS'[latitude_deg < 0]}"
        return nmea(f"GPGGA,{second:06}.00,{place},13900.0,E,{int(seen > 3)},{seen:02},1,0,M,,,,")

    def read(self, name: str, /) -> int:
        return {"baud": self._baud}[name]


def satellites(port: serial.SerialBase) -> int:
    """Return how many satellites the next valid GGA names; TimeoutError if none comes."""
    for _ in range(5):
        line = port.read_until()  # the timeout of `readline` is that of each byte: noise never ends
        text = line.decode("ascii", "replace").strip()[1:-3]
        if text.startswith("GPGGA") and nmea(text) == line:
            return int(text.split(",")[7])
    raise TimeoutError("no sentence")


def set_baud(port: serial.SerialBase, baud: int, *, follow: bool = True) -> None:
    """Change the bit rate of the receiver, and then that of the port."""
    port.write(ubx(CFG_PRT, pack("<BBHIIHHHH", 1, 0, 0, 0x8D0, baud, 3, 3, 0, 0)))
    if ubx(ACK, CFG_PRT) not in port.read_until(ubx(ACK, CFG_PRT)):
        raise TimeoutError("no acknowledgement")
    port.baudrate = baud if follow else port.baudrate


@pytest.fixture
def bench_config() -> Gnss:
    return Gnss()


@pytest.mark.parametrize("bench_mode", ["virtual"])  # a pty cannot garble
def test_a_host_that_does_not_follow_reads_noise(bench: Bench) -> None:
    port = bench.serial(timeout=1.5)
    set_baud(port, 115_200, follow=False)
    with pytest.raises(TimeoutError):
        satellites(port)
    port.baudrate = 115_200
    assert satellites(port) == 8


def test_a_wrong_sentence_is_not_believed(bench: Bench) -> None:
    bench.fault("framing=rate=0.05@0-3s")
    assert satellites(bench.serial(timeout=1.5)) == 8
    assert bench.now_us > 3_000_000
