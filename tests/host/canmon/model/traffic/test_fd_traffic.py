"""CAN FD in statistics: a row of its own, load at both bit rates, bits to 64 bytes."""

from __future__ import annotations

import json

from tickrig.host.canmon.model.check.checker import Checker
from tickrig.host.canmon.model.check.rules import Rules
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.top_model import TopModel
from tickrig.host.canmon.model.traffic import BitRates, Traffic
from tickrig.host.canmon.verbs.stats import bus_json, bus_lines, id_json
from tickrig.wire.can import BRS, CanFrame, FdFrame, fd_bits, frame_bits

WIDE = FdFrame(0x123, bytes(63) + b"\x80", flags=BRS)
SLOW = FdFrame(0x123, bytes(8))
CLASSIC = CanFrame(0x123, b"\x01")


def traffic(rates: BitRates) -> Traffic:
    taken = Traffic(rates)
    frames: tuple[CanFrame | FdFrame, ...] = (WIDE, CLASSIC, SLOW, WIDE._replace(data=bytes(64)))
    for number, frame in enumerate(frames):
        taken.take(Record(1_000 * number, "can0", frame))
    return taken


def test_an_identifier_has_a_row_for_can_fd_and_one_for_classic_can() -> None:
    classic, fd = traffic(BitRates()).snapshot().rows
    assert (classic.frames, fd.frames, fd.gap_us, fd.frame.data) == (1, 3, 1_000, bytes(64))
    changes = fd.changed.counts()
    assert (len(changes), changes[511], sum(changes)) == (512, 1, 1)
    assert json.loads(id_json(fd))["fd"] == 1
    assert "fd" not in json.loads(id_json(classic))


def test_the_load_counts_fast_bits_by_their_rate() -> None:
    plain = frame_bits(CLASSIC) + sum(fd_bits(SLOW))
    (bus,) = traffic(BitRates(500_000, 2_000_000)).snapshot().buses
    wide = [fd_bits(WIDE), fd_bits(WIDE._replace(data=bytes(64)))]
    assert bus.load.bits == plain + sum(one.nominal - -one.fast // 4 for one in wide)
    assert (bus.frames, bus.fd, bus.unrated) == (4, 3, 0)
    assert bus_lines(bus, 500_000)[2] == "  CAN FD: 3 frames"


def test_without_the_data_bit_rate_the_load_is_at_most_what_is_said() -> None:
    (bus,) = traffic(BitRates(500_000)).snapshot().buses
    assert bus.load.bits == frame_bits(CLASSIC) + sum(
        sum(fd_bits(one)) for one in (SLOW, WIDE, WIDE._replace(data=bytes(64)))
    )
    assert bus.unrated == 2
    told = "  CAN FD: 3 frames; 2 have BRS with an unknown rate: the load is lower"
    assert bus_lines(bus, 500_000)[2] == told
    assert json.loads(bus_json(bus, 500_000))["fd_unrated"] == 2


def test_the_table_shows_64_bytes_and_their_bits() -> None:
    model = TopModel(BitRates(500_000))
    model.take([Record(0, "can0", WIDE), Record(1_000, "can0", WIDE._replace(data=bytes(64)))])
    bytes_shown = model.final(0)[-1]
    assert bytes_shown.startswith("123#")
    assert bytes_shown.endswith(" ".join(["00"] * 64))
    model.press("b")
    assert model.final(0)[-1].endswith(" ".join(["·" * 8] * 63) + " █·······")
    assert "CAN FD 2, load at most (no --data-bitrate)" in model.final(0)[0]


def test_a_limit_of_the_load_takes_both_rates() -> None:
    frames = [Record(1_000 * number, "can0", WIDE) for number in range(1_100)]

    def findings(data_bit_rate: int | None) -> list[str]:
        checker = Checker(Rules(max_load=50.0), 500_000, data_bit_rate)
        return [one.text for record in frames for one in checker.take(record)]

    assert len(findings(None)) == 1
    assert findings(4_000_000) == []


def test_other_rules_see_can_fd_as_no_service_and_know_its_identifiers_apart() -> None:
    checker = Checker(Rules(no_emcy=True, known=frozenset([0x081])))
    found = checker.take(Record(0, "can0", FdFrame(0x081, b"\x30\x81")))
    assert [one.text for one in found] == ["081# is not expected"]
