"""Rules against the demonstration of Fig. 120: they hold, and find each fault that is put in."""

from __future__ import annotations

from dataclasses import fields

import pytest

from tests.host.canmon.model.column_log import blocks
from tests.host.canmon.model.record_log import hear
from tickrig.emulators.demos.fig120 import BIT_RATE, LINK, MOTOR, PALETTE, VirtualStage, run_demo
from tickrig.host.canmon.model.check.checker import Checker
from tickrig.host.canmon.model.check.column_check import ColumnChecker
from tickrig.host.canmon.model.check.rule import Rule, TrafficFinding
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.frames import EXTENDED, Record
from tickrig.wire.can import CanFrame


class NoExtended(Rule):
    """A rule of another package."""

    name = "no-extended"

    def wants(self, ident: int, /) -> bool:
        return bool(ident & EXTENDED)

    def judge(self, record: Record, gap_us: int | None, /) -> str | None:
        return "an extended identifier"


RULES = parse_rules(
    {
        "max_load": 10,
        "bitrate": 500_000,
        "no_emcy": True,
        "no_sdo_abort": True,
        "no_error_frames": True,
        "no_reboot": True,
        "no_lost_heartbeat": True,
        "no_loss": True,
        "heartbeat": [f"{PALETTE}=100ms±10%", f"{MOTOR}=100ms±10%"],
        "nodes": f"{PALETTE},{MOTOR}",
        "max_gap": f"{LINK:03X}=51ms",
        "known": "000,190,290,2A0,390,590,5A0,610,620,710,720",
        "rule": "no-extended",
    },
    {"no-extended": NoExtended}.__getitem__,
)
S = 1_000_000


@pytest.fixture(scope="module")
def trace() -> list[Record]:
    stage, record = VirtualStage(), list[Record]()
    stage.wire.observers.append(lambda at_us, frame: record.append(Record(at_us, "can0", frame)))
    run_demo(stage, lambda text: None)
    return record


def findings(records: list[Record], lost: tuple[str, ...] = ()) -> list[TrafficFinding]:
    checker = Checker(RULES, BIT_RATE)
    found = [finding for record in records for finding in checker.take(record)]
    found += checker.end(records[-1].at_us, lost)
    in_blocks = ColumnChecker(RULES, BIT_RATE)
    of_blocks = [finding for block in blocks(records, 50) for finding in in_blocks.take(block)]
    assert of_blocks + in_blocks.end(lost) == found
    return found


def with_frames(trace: list[Record], text: str) -> list[Record]:
    return sorted([*trace, *hear(text)], key=lambda record: record.at_us)


def test_all_rules_are_held_against_it() -> None:
    default = parse_rules({})
    for field in fields(RULES):
        if field.name == "expressions":  # they are not held against whole logs
            continue
        assert getattr(RULES, field.name) != getattr(default, field.name)


def test_nothing_is_found(trace: list[Record]) -> None:
    assert findings(trace) == []


@pytest.mark.parametrize(
    ("frame", "rule", "text"),
    [
        ("090#1023030000000000", "no-emcy", "node 16: EMCY 2310h"),
        ("5A0#8000200000000206", "no-sdo-abort", "node 32: server aborts 2000h:00"),
        ("20000088#0000010000000000", "no-error-frames", "protocol: single bit"),
    ],
)
def test_a_frame_that_is_put_in_is_found(
    trace: list[Record], frame: str, rule: str, text: str
) -> None:
    found = [one for one in findings(with_frames(trace, f"2 {frame}")) if one.rule != "known"]
    assert [one.rule for one in found] == [rule]
    assert all(one.text.startswith(text) for one in found)


def test_an_unknown_identifier_is_found(trace: list[Record]) -> None:
    (found,) = findings(with_frames(trace, "2 123#00"))
    assert (found.rule, found.text, found.at_us) == ("known", "123 is not expected", 2 * S)


def without(trace: list[Record], can_id: int, begin_us: int, end_us: int) -> list[Record]:
    return [
        record
        for record in trace
        if not (
            isinstance(record.frame, CanFrame)
            and record.frame.can_id == can_id
            and begin_us <= record.at_us < end_us
        )
    ]


def without_node(trace: list[Record], node: int) -> list[Record]:
    for function in (0x080, 0x180, 0x280, 0x580, 0x700):
        trace = without(trace, function + node, 0, 99 * S)
    return trace


def test_a_heartbeat_that_is_missing_is_found(trace: list[Record]) -> None:
    found = findings(without(trace, 0x700 + MOTOR, 2 * S, 2 * S + 100_000))
    assert [one.rule for one in found] == ["no-lost-heartbeat", "heartbeat 32"]
    assert all("200.0" in one.text for one in found)


def test_a_node_that_dies_is_found(trace: list[Record]) -> None:
    found = findings(without(trace, 0x700 + PALETTE, 3 * S, 99 * S))
    assert [one.rule for one in found] == ["no-lost-heartbeat", "heartbeat 16"]
    assert {one.at_us for one in found} == {trace[-1].at_us}


def test_a_node_that_is_not_there_is_found(trace: list[Record]) -> None:
    found = findings(without_node(trace, MOTOR))
    assert [one.rule for one in found] == ["heartbeat 32", "nodes"]


def test_a_pdo_that_is_missing_is_found(trace: list[Record]) -> None:
    (found,) = findings(without(trace, LINK, 4 * S, 4 * S + 60_000))
    assert found.rule == "max-gap 290"


def test_a_boot_in_between_is_found(trace: list[Record]) -> None:
    heartbeat = next(h for h in trace if h.at_us > 3 * S and str(h.frame) == "710#05")
    found = findings(with_frames(trace, f"{heartbeat.at_us / 1e6 + 0.01:.6f} 710#00"))
    assert [one.rule for one in found] == ["no-reboot"]


def test_a_bus_that_is_too_busy_is_found(trace: list[Record]) -> None:
    burst = "\n".join(f"{2.5 + n * 1e-4:.6f} 290#0040" for n in range(2_000))
    (found,) = findings(with_frames(trace, burst))
    assert found.rule == "max-load"


def test_a_line_that_is_lost_is_found(trace: list[Record]) -> None:
    (found,) = findings(trace, ("line 7 is no frame",))
    assert (found.rule, found.text) == ("no-loss", "line 7 is no frame")
