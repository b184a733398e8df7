from __future__ import annotations

from pathlib import Path

from tickrig.host.canmon.conform.conformance import decoded_frames
from tickrig.host.canopen.conform.bus.exchange import FIRST_LINES, LAST_LINES, Evidence
from tickrig.host.canopen.conform.verdict import Direction, FrameLine

EDS = Path("examples/io_module.eds")


def lines(*frames: str) -> list[FrameLine]:
    """Return frames, those to the node and those from it in turn."""
    ways = (Direction.SENT, Direction.RECEIVED)
    return [FrameLine(1_000 * at, ways[at % 2], text) for at, text in enumerate(frames)]


OPEN = lines("605#4008100000000000", "585#410810000A000000")
ASKS = lines("605#4014100100000000", "585#8014100111000906")


def test_a_transfer_that_a_check_left_open_is_not_told_in_the_next_one() -> None:
    show = decoded_frames({})
    assert "segments follow" in show(OPEN)[-1]
    first, second = show(ASKS)
    assert first.endswith("upload of 1014h:01 asked for")
    assert "upload 1014h:01 (aborted by server" in second
    assert show(ASKS) == decoded_frames({})(ASKS)


def test_a_second_go_does_not_go_on_with_the_transfer_of_the_first() -> None:
    show = decoded_frames({})
    show(lines("605#6000000000000000", "585#004B7565686C7075"))
    again = show(lines("605#6000000000000000", "585#8000100000000305"))
    assert "0 B so far" in again[0]
    assert "0x7570" not in again[1]


def test_values_of_a_check_are_none_of_the_next() -> None:
    remapped = lines(
        *("605#23001A0100020020", "585#60001A0100000000"),
        *("605#2F001A0001000000", "585#60001A0000000000"),
        *("605#2300180185010000", "585#6000180100000000"),
    )
    pdo = [FrameLine(0, Direction.RECEIVED, "185#01")]
    alone = decoded_frames({5: EDS})(pdo)
    show = decoded_frames({5: EDS})
    show(remapped)
    assert show(pdo) == alone


def test_lines_that_were_left_out_end_what_was_open() -> None:
    evidence = Evidence()
    for line in OPEN * FIRST_LINES:
        evidence.add(*line)
    for line in ASKS * (LAST_LINES // len(ASKS)):
        evidence.add(*line)
    shown = decoded_frames({})(evidence.lines())
    assert "lines left out" in shown[FIRST_LINES]
    assert shown[FIRST_LINES + 1].endswith("upload of 1014h:01 asked for")
