from __future__ import annotations

import pytest

from tests.host.canmon.model.record_log import hear, snapshot
from tickrig.host.canmon.model.frames import EXTENDED, REMOTE, ident_text, parse_ident
from tickrig.host.canmon.model.traffic import Traffic, TrafficSnapshot
from tickrig.wire.can import CanFrame, frame_bits


def test_an_identifier_has_a_row_with_its_latest_frame() -> None:
    (row,) = snapshot(hear("0.0 181#00\n0.1 181#01\n0.3 181#02")).rows
    assert (row.frames, row.first_us, row.last_us) == (3, 0, 300_000)
    assert (str(row.frame), row.gap_us) == ("181#02", 200_000)
    assert row.rate_hz == pytest.approx(2 / 0.3)


def test_the_first_frame_has_no_gap_and_no_rate() -> None:
    (row,) = snapshot(hear("0.0 181#00")).rows
    assert (row.gap_us, row.gaps, row.rate_hz) == (None, None, 0.0)


def test_11_bit_29_bit_and_remote_frames_have_rows_of_their_own() -> None:
    rows = snapshot(hear("0 181#00\n0 00000181#00\n0 181#R\n0 00000181#R2")).rows
    idents = [0x181, 0x181 | REMOTE, 0x181 | EXTENDED, 0x181 | EXTENDED | REMOTE]
    assert [row.ident for row in rows] == idents
    assert [ident_text(ident) for ident in idents] == ["181", "181R", "00000181", "00000181R"]


@pytest.mark.parametrize("text", ["181", "181R", "00000181", "1FFFFFFFR"])
def test_an_identifier_is_read_as_it_is_written(text: str) -> None:
    assert ident_text(parse_ident(text)) == text


@pytest.mark.parametrize("text", ["", "18", "800", "20000000", "0x1", "18G", "1811"])
def test_what_is_no_identifier_is_said(text: str) -> None:
    with pytest.raises(ValueError, match="is not a CAN-ID: write 3 or 8 hex digits"):
        parse_ident(text)


def test_rows_of_two_buses_stand_apart() -> None:
    records = hear("0 181#00", "can1") + hear("0 181#01", "can0")
    assert [(row.channel, str(row.frame)) for row in snapshot(records).rows] == [
        ("can0", "181#01"),
        ("can1", "181#00"),
    ]


def test_bits_of_a_bus_are_those_of_its_frames() -> None:
    records = hear("0 181#00\n0.1 181#00\n0.2 701#05\n0.3 181#FFFF")
    found = snapshot(records)
    frames = [record.frame for record in records if isinstance(record.frame, CanFrame)]
    assert found.buses[0].load.bits == sum(map(frame_bits, frames))
    assert sum(row.bits for row in found.rows) == found.buses[0].load.bits


def test_error_frames_have_no_row_but_count_for_their_bus() -> None:
    found = snapshot(hear("0 181#00\n0.1 20000020#0000000000000000"))
    assert len(found.rows) == 1
    assert (found.buses[0].frames, found.buses[0].errors.frames) == (1, 1)


def test_time_that_goes_back_is_counted_and_is_no_gap() -> None:
    found = snapshot(hear("1 181#00\n0.5 181#00\n0.6 181#00"))
    assert found.buses[0].went_back == 1
    gaps = found.rows[0].gaps
    assert gaps is not None
    assert (gaps.min_us, gaps.max_us) == (0, 100_000)


def test_a_cleared_model_begins_anew() -> None:
    traffic = Traffic()
    for record in hear("0 181#00\n0.1 181#01"):
        traffic.take(record)
    traffic.clear()
    for record in hear("5 181#00"):
        traffic.take(record)
    (row,) = traffic.snapshot().rows
    assert (row.frames, row.first_us) == (1, 5_000_000)


def test_a_notch_is_for_all_rows() -> None:
    traffic = Traffic()
    for record in hear("0 181#00\n0.1 181#01"):
        traffic.take(record)
    traffic.notch()
    assert traffic.snapshot().rows[0].changed.changed == 0


def test_without_frames_a_snapshot_is_empty() -> None:
    assert Traffic().snapshot() == TrafficSnapshot()
