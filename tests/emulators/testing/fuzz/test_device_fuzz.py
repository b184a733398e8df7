"""Bytes of chance find a device that raises or falls silent; each run begins with the same one."""

from __future__ import annotations

from functools import partial
from random import Random
from typing import Any

import pytest

import tickrig.testing
from tests.emulators.echo import Echo
from tickrig.device.canopen.models.epos import make_epos
from tickrig.emulators.testing.fuzz import DeviceFuzz, SilentDeviceError
from tickrig.testing import fuzz_one_input
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER


class Picky(Echo):
    """Takes no byte above 7Fh."""

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        return super().tick(now_us, rx.decode("ascii").encode())


class Offended(Echo):
    """Says nothing any more once it was called names."""

    offended = False

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.offended = self.offended or b"fool" in rx
        return b"" if self.offended else super().tick(now_us, rx)


class Counter(Echo):
    """Counts what it hears, for ever."""

    count = 0

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.count += len(rx)
        return super().tick(now_us, rx)


class DeafNode:
    """A device on CAN that hears nothing after a frame without data."""

    tick_us, due_us, deaf = 1_000, NEVER, False

    def reset(self) -> None:
        return

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        self.deaf = self.deaf or any(not frame.data for frame in rx)
        return () if self.deaf else tuple(CanFrame(0x181, frame.data) for frame in rx)


def throw(fuzz: DeviceFuzz, count: int = 400) -> None:
    for number in range(count):
        chance = Random(number)
        fuzz(chance.randbytes(chance.randrange(1, 40)))


def test_a_device_that_raises_is_found() -> None:
    with pytest.raises(UnicodeDecodeError) as caught:
        throw(DeviceFuzz(Picky, [b"on"]))
    assert caught.value.__notes__[0].startswith("what was done:\n")
    assert "send " in caught.value.__notes__[0]


def test_a_device_that_falls_silent_is_found() -> None:
    fuzz = DeviceFuzz(Offended, [b"fool"], request=[b"hello"], answer=b"hello")
    with pytest.raises(SilentDeviceError, match="asked b'hello' it says b'', without b'hello'"):
        throw(fuzz)


def test_what_it_says_instead_is_told_and_no_act_that_is_not_needed() -> None:
    fuzz = DeviceFuzz(Offended, [b"fool", b"you"], request=[b"hello", b"?"], answer=b"good day")
    with pytest.raises(SilentDeviceError) as caught:
        fuzz(bytes(40))
    assert str(caught.value) == "asked b'hello', b'?' it says b'', without b'good day'"
    fuzz = DeviceFuzz(Echo, [b"you"], request=[b"hello"], answer=b"good day")
    with pytest.raises(SilentDeviceError) as caught:
        fuzz(bytes(40))
    assert str(caught.value).startswith("asked b'hello' it says b'hello")
    assert caught.value.__notes__ == ["what was done:"]


def test_the_acts_that_are_needed_are_left() -> None:
    fuzz = DeviceFuzz(Offended, [b"you\n", b"fool\n"], request=[b"hello"], answer=b"hello")
    with pytest.raises(SilentDeviceError) as caught:
        fuzz(bytes([0, 0, 0] * 5 + [0, 0, 1] + [0, 0, 0] * 5))
    assert caught.value.__notes__ == ["what was done:\nsend fool\\n, wait 0 us"]


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"words": "ON\n"}, r"words: a list, as \[b'ON\\\\n'\], got 'ON"),
        ({"words": b"ON\n"}, r"words: a list, as \[b'ON\\\\n'\], got b'ON"),
        ({"words": [1]}, "words: bytes, or a frame as '705#7F', got 1"),
        ({"words": ["ON"]}, "words: this device is on a line: bytes, got 'ON'"),
        ({"start": b"ON\n"}, "start: a list"),
        ({"request": b"\nOFF\n", "answer": b"OK"}, "request: a list"),
        ({"answer": b"OK"}, "answer without request: nothing is asked"),
        ({"request": [b"OFF\n"]}, "request without answer"),
        ({"request": [b"OFF\n"], "answer": "OK"}, "answer: this device is on a line: bytes, got"),
    ],
)
def test_words_that_are_none_are_refused(options: dict[str, Any], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        DeviceFuzz(Echo, **options)


def test_the_error_of_a_silent_device_is_public() -> None:
    assert tickrig.testing.SilentDeviceError is SilentDeviceError


def test_so_is_one_on_can() -> None:
    from tickrig.emulators.can.wire import CanWire  # noqa: PLC0415 - beside its use

    fuzz = DeviceFuzz(DeafNode, ["123#01"], request=["123#0102"], answer="181#0102", wire=CanWire)
    with pytest.raises(SilentDeviceError, match="it says nothing, without '181#0102'"):
        throw(fuzz)


def test_one_that_answers_is_not() -> None:
    throw(DeviceFuzz(Echo, [b"fool"], request=[b"hello"], answer=b"hello"))
    throw(fuzz_one_input("rrc", words=[b"device\n"]), 40)  # type: ignore[arg-type] # called alike
    ask = ["605#4000100000000000", "000#8205"]
    drive = DeviceFuzz(partial(make_epos, 5), ["000#0105"], request=ask, answer="585#43001000")
    throw(drive, 40)


def test_each_run_begins_with_the_same_device() -> None:
    fuzz = DeviceFuzz(Counter, [b"a"], start=[b"bc"])
    assert fuzz.device.count == 2
    counts = []
    for _ in range(3):
        fuzz(b"\0\0\0" * 5)
        counts.append(fuzz.device.count)
    assert counts == [7, 7, 7]


def test_the_same_bytes_do_the_same() -> None:
    fuzz = DeviceFuzz("rrc", [b"device\n"])
    runs = [
        [str(act) for seed in range(9) for act in fuzz.acts(Random(seed).randbytes(200))]
        for _ in range(2)
    ]
    assert runs[0] == runs[1]
    assert {act.split()[0].rstrip(",") for act in runs[0]} == {"send", "set", "reset"}
