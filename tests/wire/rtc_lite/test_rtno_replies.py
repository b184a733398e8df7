"""Packets of an RTno device, read as frames by a proxy."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault
from tickrig.wire.rtc_lite.frame import LiteFrame, fault_frame
from tickrig.wire.rtc_lite.rtno import RtnoReplies, encode_packet, encode_request, pack


@pytest.mark.parametrize(
    ("sent", "read"),
    [
        (LiteFrame(LiteCommand.STATE, b"@E"), LiteFrame(LiteCommand.STATE, b"@E")),
        (LiteFrame(LiteCommand.CONTEXT, b"@\x22"), LiteFrame(LiteCommand.CONTEXT, b"@\x22")),
        (LiteFrame(LiteCommand.ACTIVATE, b"@A"), LiteFrame(LiteCommand.ACTIVATE, b"@A")),
        (LiteFrame(LiteCommand.DEACTIVATE, b"@I"), LiteFrame(LiteCommand.DEACTIVATE, b"@I")),
        (LiteFrame(LiteCommand.EXECUTE, b"@A"), LiteFrame(LiteCommand.EXECUTE, b"@A")),
        (LiteFrame(LiteCommand.EXECUTE, b"xE"), LiteFrame(LiteCommand.EXECUTE, b"xE")),
        (LiteFrame(LiteCommand.EXECUTE, b"HI"), LiteFrame(LiteCommand.EXECUTE, b"H?")),
        (LiteFrame(LiteCommand.ERROR, b"@E"), LiteFrame(LiteCommand.ERROR, b"@E")),
        (LiteFrame(LiteCommand.RESET, b"@I"), LiteFrame(LiteCommand.RESET, b"@I")),
        (LiteFrame(LiteCommand.RESET, b"!"), LiteFrame(LiteCommand.RESET, b"!")),
        (LiteFrame(LiteCommand.WRITE, b"@"), LiteFrame(LiteCommand.WRITE, b"@")),
        (LiteFrame(LiteCommand.WRITE, b"F"), LiteFrame(LiteCommand.WRITE, b"F")),
        (LiteFrame(LiteCommand.DATA, b"\2\1in\7"), LiteFrame(LiteCommand.DATA, b"\2\1in\7")),
        (LiteFrame(LiteCommand.IN_PROFILE, b"\3lin"), LiteFrame(LiteCommand.IN_PROFILE, b"\3lin")),
        (fault_frame(LiteLinkFault.CHECKSUM), fault_frame(LiteLinkFault.CHECKSUM)),
        (fault_frame(LiteLinkFault.UNKNOWN), fault_frame(LiteLinkFault.UNKNOWN)),
    ],
)
def test_a_packet_of_a_device_is_read_as_a_frame(sent: LiteFrame, read: LiteFrame) -> None:
    assert RtnoReplies().push(encode_packet(sent)) == [read]


def test_a_profile_counts_the_ports_since_the_one_before() -> None:
    replies = RtnoReplies()
    in_, out = (
        LiteFrame(LiteCommand.IN_PROFILE, b"\3lin"),
        LiteFrame(LiteCommand.OUT_PROFILE, b"\4lout"),
    )
    end = LiteFrame(LiteCommand.PROFILE, b"@\0\0\0")
    for _ in range(2):
        for frame in (in_, in_, out):
            replies.push(encode_packet(frame))
        assert replies.push(encode_packet(end)) == [LiteFrame(LiteCommand.PROFILE, b"@\2\1\4RTno")]


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
    assert RtnoReplies().push(packet) == [LiteLinkFault.UNKNOWN]


def test_what_is_too_long_is_thrown_away_until_it_is_cleared() -> None:
    replies = RtnoReplies()
    good = encode_packet(LiteFrame(LiteCommand.STATE, b"@I"))
    assert replies.push(b"\n\nX\xff" + good[:1]) == [LiteLinkFault.UNKNOWN]
    assert replies.lost
    replies.clear()
    assert replies.push(good[:3]) == []
    assert replies.begun
    assert replies.push(good[3:]) == [LiteFrame(LiteCommand.STATE, b"@I")]


def test_a_request_is_written_as_a_packet() -> None:
    assert encode_request(LiteFrame(LiteCommand.ACTIVATE)) == b"\n\nA\0A"
    with pytest.raises(KeyError):
        encode_request(LiteFrame(LiteCommand.PING, b"\1"))


@given(st.binary(max_size=200))
def test_after_any_noise_a_cleared_decoder_reads_the_next_packet(noise: bytes) -> None:
    replies = RtnoReplies()
    replies.push(noise)
    replies.clear()
    found = replies.push(encode_packet(LiteFrame(LiteCommand.STATE, b"@A")))
    assert found == [LiteFrame(LiteCommand.STATE, b"@A")]
