"""Packets of an RTno device, read as frames by a proxy."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.rtc_lite.codes import Command, LinkFault
from tickrig.wire.rtc_lite.frame import Frame, fault_frame
from tickrig.wire.rtc_lite.rtno import RtnoReplies, encode_packet, encode_request, pack


@pytest.mark.parametrize(
    ("sent", "read"),
    [
        (Frame(Command.STATE, b"@E"), Frame(Command.STATE, b"@E")),
        (Frame(Command.CONTEXT, b"@\x22"), Frame(Command.CONTEXT, b"@\x22")),
        (Frame(Command.ACTIVATE, b"@A"), Frame(Command.ACTIVATE, b"@A")),
        (Frame(Command.DEACTIVATE, b"@I"), Frame(Command.DEACTIVATE, b"@I")),
        (Frame(Command.EXECUTE, b"@A"), Frame(Command.EXECUTE, b"@A")),
        (Frame(Command.EXECUTE, b"xE"), Frame(Command.EXECUTE, b"xE")),
        (Frame(Command.EXECUTE, b"HI"), Frame(Command.EXECUTE, b"H?")),
        (Frame(Command.ERROR, b"@E"), Frame(Command.ERROR, b"@E")),
        (Frame(Command.RESET, b"@I"), Frame(Command.RESET, b"@I")),
        (Frame(Command.RESET, b"!"), Frame(Command.RESET, b"!")),
        (Frame(Command.WRITE, b"@"), Frame(Command.WRITE, b"@")),
        (Frame(Command.WRITE, b"F"), Frame(Command.WRITE, b"F")),
        (Frame(Command.DATA, b"\2\1in\7"), Frame(Command.DATA, b"\2\1in\7")),
        (Frame(Command.IN_PROFILE, b"\3lin"), Frame(Command.IN_PROFILE, b"\3lin")),
        (fault_frame(LinkFault.CHECKSUM), fault_frame(LinkFault.CHECKSUM)),
        (fault_frame(LinkFault.UNKNOWN), fault_frame(LinkFault.UNKNOWN)),
    ],
)
def test_a_packet_of_a_device_is_read_as_a_frame(sent: Frame, read: Frame) -> None:
    assert RtnoReplies().push(encode_packet(sent)) == [read]


def test_a_profile_counts_the_ports_since_the_one_before() -> None:
    replies = RtnoReplies()
    in_, out = Frame(Command.IN_PROFILE, b"\3lin"), Frame(Command.OUT_PROFILE, b"\4lout")
    end = Frame(Command.PROFILE, b"@\0\0\0")
    for _ in range(2):
        for frame in (in_, in_, out):
            replies.push(encode_packet(frame))
        assert replies.push(encode_packet(end)) == [Frame(Command.PROFILE, b"@\2\1\4RTno")]


@pytest.mark.parametrize(
    "packet",
    [
        pack(b"F", b""),
        pack(b"F", b"\1"),
        pack(b"q", b""),
        pack(b"X", b""),
        pack(b"A", b""),
        pack(b"S", b"@@"),
        pack(b"P", b"l" * 60),
    ],
)
def test_a_packet_that_means_nothing_is_told(packet: bytes) -> None:
    assert RtnoReplies().push(packet) == [LinkFault.UNKNOWN]


def test_what_is_too_long_is_thrown_away_until_it_is_cleared() -> None:
    replies = RtnoReplies()
    good = encode_packet(Frame(Command.STATE, b"@I"))
    assert replies.push(b"\n\nX\xff" + good[:1]) == [LinkFault.UNKNOWN]
    assert replies.lost
    replies.clear()
    assert replies.push(good[:3]) == []
    assert replies.begun
    assert replies.push(good[3:]) == [Frame(Command.STATE, b"@I")]


def test_a_request_is_written_as_a_packet() -> None:
    assert encode_request(Frame(Command.ACTIVATE)) == b"\n\nA\0A"
    with pytest.raises(KeyError):
        encode_request(Frame(Command.PING, b"\1"))


@given(st.binary(max_size=200))
def test_after_any_noise_a_cleared_decoder_reads_the_next_packet(noise: bytes) -> None:
    replies = RtnoReplies()
    replies.push(noise)
    replies.clear()
    found = replies.push(encode_packet(Frame(Command.STATE, b"@A")))
    assert found == [Frame(Command.STATE, b"@A")]
