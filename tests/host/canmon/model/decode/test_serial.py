from __future__ import annotations

import pytest

from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.sources.line_source import RrcLines, RtcLiteLine
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import Checksum, LiteFrame
from tickrig.wire.rtc_lite.messages import (
    LiteComponentProfile,
    LitePortData,
    LitePortProfile,
    LiteReply,
)


def rrc(data: bytes, *, to_device: bool) -> list[str]:
    lines = RrcLines("ttyS0").take(0, data, to_device=to_device)
    assert {line.channel for line in lines} <= {"ttyS0"}
    return [line.decoded.text for line in lines]


@pytest.mark.parametrize(
    ("line", "text"),
    [
        (b"output1eff\n", "output v_pct=30 w_pct=-1"),
        (b"output1e007\n", "output v_pct=30 w_pct=0"),
        (b"device\n", "device"),
        (b"beep01020000000000000000\n", "beep times_10ms=1 2 0 0 0 0 0 0 0 0"),
    ],
)
def test_a_command_to_the_rrc_says_this(line: bytes, text: str) -> None:
    assert rrc(line, to_device=True) == [text]


def test_a_line_that_is_no_command_is_said_to_be() -> None:
    (text,) = rrc(b"fly\n", to_device=True)
    assert text.startswith("b'fly' is not one of limit, output")


@pytest.mark.parametrize(
    ("line", "text"),
    [
        (b"OK:beep\r\n", "OK beep"),
        (b"ER:CommandUnknown\n", "refused CommandUnknown"),
        (b"EV:PowerOnTrigger\n", "event PowerOnTrigger"),
        (b"RRC 1.0\n", "RRC 1.0"),
        (b"SA:1\n", "b'SA:1' has 4 characters, an SA line has 17"),
    ],
)
def test_a_line_of_the_rrc_says_this(line: bytes, text: str) -> None:
    assert rrc(line, to_device=False) == [text]


@pytest.mark.parametrize(
    ("text", "passes"),
    [
        ("rrc and gauge = 10", True),
        ("rtc-lite", False),
        ("channel = ttyS0 and dir = rx", True),
        ("123:7FF or 181-18F or id = 5 or dlc = 8 or error", False),
        ("not node = 3", True),
        ("in_v_pct > 99", True),
    ],
)
def test_a_filter_takes_lines_as_it_takes_frames(text: str, passes: bool) -> None:
    (line,) = RrcLines("ttyS0").take(0, b"SA:64003200A1000F\n", to_device=False)
    assert parse_filter(text).matches(line, line.decoded) is passes


def test_the_status_of_the_rrc_has_signals() -> None:
    lines = RrcLines("ttyS0").take(0, b"SA:64003200A1000F\n", to_device=False)
    signals = {signal.name: signal.value for signal in lines[0].decoded.signals}
    assert (signals["in_v_pct"], signals["out_v_pct"], signals["gauge"]) == (100, 50, 10)


def test_how_a_line_is_cut_makes_no_difference() -> None:
    lines = RrcLines("ttyS0")
    assert lines.take(0, b"EV:Pow", to_device=False) == []
    (line,) = lines.take(5_000, b"erOn\n", to_device=False)
    assert (line.at_us, line.decoded.text) == (5_000, "event PowerOn")


def rtc_lite(frame: LiteFrame, *, to_device: bool) -> str:
    (line,) = RtcLiteLine("ttyS0").take(0, frame.encode(), to_device=to_device)
    return line.decoded.text


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (LiteFrame(LiteCommand.ACTIVATE), "activate"),
        (LiteFrame(LiteCommand.PING, b"\x07"), "ping 07"),
        (LiteFrame(LiteCommand.WRITE, LitePortData(b"in", b"\x2a\0").encode()), "write in: 2A 00"),
    ],
)
def test_a_request_of_rtc_lite_says_this(frame: LiteFrame, text: str) -> None:
    assert rtc_lite(frame, to_device=True) == text


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (LiteFrame(LiteCommand.STATE, LiteReply(ord("@"), b"C").encode()), "state: ok, created"),
        (LiteFrame(LiteCommand.STATE, LiteReply(ord("@"), b"z").encode()), "state: ok, 7Ah"),
        (LiteFrame(LiteCommand.WRITE, LiteReply(ord("F")).encode()), "write: no in port"),
        (LiteFrame(LiteCommand.WRITE, LiteReply(ord("~")).encode()), "write: 126"),
        (LiteFrame(LiteCommand.PING, LiteReply(ord("@"), b"\x07").encode()), "ping: ok, 07"),
        (LiteFrame(LiteCommand.DATA, LitePortData(b"out", b"\1").encode()), "data out: 01"),
        (
            LiteFrame(LiteCommand.IN_PROFILE, LitePortProfile("L", b"in").encode()),
            "in profile in: L",
        ),
        (
            LiteFrame(
                LiteCommand.PROFILE,
                LiteReply(ord("@"), LiteComponentProfile(1, 1, b"Lamp").encode()).encode(),
            ),
            "profile: ok, Lamp",
        ),
        (LiteFrame(LiteCommand.CHECKSUM_FAULT, b"\3"), "checksum fault"),
        (
            LiteFrame(LiteCommand.OUT_PROFILE, b"\0"),
            "out profile: 00 is not a length, a letter and a name",
        ),
    ],
)
def test_an_answer_of_rtc_lite_says_this(frame: LiteFrame, text: str) -> None:
    assert rtc_lite(frame, to_device=False) == text


def test_bytes_that_are_no_frame_are_said_to_be() -> None:
    line = RtcLiteLine("ttyS0", Checksum.XOR8)
    data = LiteFrame(LiteCommand.STATE).encode(Checksum.SUM8)
    (found,) = line.take(0, data, to_device=True)
    assert found.decoded.text == "no frame: checksum"
    assert line.take(1_000, b"\nZZZ", to_device=True)[0].decoded.text == "no frame: unknown"
    whole = LiteFrame(LiteCommand.STATE).encode(Checksum.XOR8)
    assert line.take(2_000, whole, to_device=True) == []
    assert [found.decoded.text for found in line.take(30_000, whole, to_device=True)] == ["state"]


def test_a_frame_that_stops_is_forgotten_after_100_ms() -> None:
    line = RtcLiteLine("ttyS0")
    whole = LiteFrame(LiteCommand.STATE).encode()
    assert line.take(0, whole[:2], to_device=True) == []
    (found,) = line.take(100_000, whole, to_device=True)
    assert found.decoded.text == "state"
