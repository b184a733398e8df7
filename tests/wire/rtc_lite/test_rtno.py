"""Bridge mode: packets written by hand after the digest of RTno v3 and v4."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.wire.rtc_lite.vectors import raw
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault
from tickrig.wire.rtc_lite.frame import LiteFrame, fault_frame
from tickrig.wire.rtc_lite.rtno import RtnoDecoder, encode_packet

WRITE = "0A 0A 53 08 02 04 69 6E 2A 00 00 00 62"


@pytest.mark.parametrize(
    ("packet", "frame"),
    [
        ("0A 0A 41 00 41", LiteFrame(LiteCommand.ACTIVATE)),
        ("0A 0A 44 00 44", LiteFrame(LiteCommand.DEACTIVATE)),
        ("0A 0A 45 00 45", LiteFrame(LiteCommand.EXECUTE)),
        ("0A 0A 43 00 43", LiteFrame(LiteCommand.ERROR)),
        ("0A 0A 52 00 52", LiteFrame(LiteCommand.RESET)),
        ("0A 0A 58 00 58", LiteFrame(LiteCommand.STATE)),
        ("0A 0A 5A 00 5A", LiteFrame(LiteCommand.PROFILE)),
        ("0A 0A 42 00 42", LiteFrame(LiteCommand.CONTEXT)),
        (WRITE, LiteFrame(LiteCommand.WRITE, b"\x02\x04in\x2a\x00\x00\x00")),
    ],
)
def test_a_packet_of_the_proxy_is_read(packet: str, frame: LiteFrame) -> None:
    assert RtnoDecoder().push(raw(packet)) == [frame]


@pytest.mark.parametrize(
    ("frame", "packet"),
    [
        (LiteFrame(LiteCommand.ACTIVATE, b"@A"), "0A 0A 41 01 40 82"),
        (LiteFrame(LiteCommand.STATE, b"@A"), "0A 0A 58 01 41 9A"),
        (LiteFrame(LiteCommand.CONTEXT, b"@\x21"), "0A 0A 42 01 21 64"),
        (LiteFrame(LiteCommand.IN_PROFILE, b"\x03lin"), "0A 0A 50 03 6C 69 6E 96"),
        (LiteFrame(LiteCommand.OUT_PROFILE, b"\x04lout"), "0A 0A 51 04 6C 6F 75 74 19"),
        (LiteFrame(LiteCommand.PROFILE, b"@\x01\x01\x05Echo0"), "0A 0A 5A 01 40 9B"),
        (LiteFrame(LiteCommand.DATA, b"\x03\x01out\x2a"), "0A 0A 56 06 03 01 6F 75 74 2A E2"),
        (fault_frame(LiteLinkFault.CHECKSUM), "0A 0A 46 01 FD 44"),
    ],
)
def test_a_frame_of_the_device_is_written(frame: LiteFrame, packet: str) -> None:
    assert encode_packet(frame) == raw(packet)


def test_nothing_begins_behind_an_unknown_letter() -> None:
    decoder = RtnoDecoder()
    assert decoder.push(raw("0A 0A 7A 00 7A", "0A 0A 58")) == [LiteLinkFault.UNKNOWN]
    assert not decoder.begun


def test_chunking_makes_no_difference() -> None:
    decoder = RtnoDecoder()
    found = [item for code in raw("41 0A 41", WRITE) for item in decoder.push(bytes([code]))]
    assert found == RtnoDecoder().push(raw(WRITE))


@pytest.mark.parametrize(
    ("packet", "fault"),
    [
        ("0A 0A 41 00 42", LiteLinkFault.CHECKSUM),
        ("0A 0A 7A 00 7A", LiteLinkFault.UNKNOWN),
        ("0A 0A 41 01 00 42", LiteLinkFault.UNKNOWN),
        ("0A 0A 53 3D 00", LiteLinkFault.UNKNOWN),
    ],
    ids=["checksum", "letter", "length", "too long"],
)
def test_a_bad_packet_is_told(packet: str, fault: LiteLinkFault) -> None:
    decoder = RtnoDecoder()
    assert decoder.push(raw(packet)) == [fault]
    assert decoder.lost == (fault is LiteLinkFault.UNKNOWN)
    assert decoder.push(raw("0A 0A 58 00 58")) == (
        [] if decoder.lost else [LiteFrame(LiteCommand.STATE)]
    )


@given(st.binary(max_size=200))
def test_after_any_noise_a_cleared_decoder_reads_the_next_packet(noise: bytes) -> None:
    decoder = RtnoDecoder()
    decoder.push(noise)
    decoder.clear()
    assert not decoder.begun
    assert decoder.push(raw("0A 0A 58 00 58")) == [LiteFrame(LiteCommand.STATE)]


def test_what_rtno_has_no_letter_for_cannot_be_sent() -> None:
    with pytest.raises(KeyError):
        encode_packet(LiteFrame(LiteCommand.PING, b"@\x01"))
