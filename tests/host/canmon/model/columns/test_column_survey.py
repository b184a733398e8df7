"""A log that a client polls, with faults: in blocks the page and the findings are the same."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.host.canmon.model.column_log import blocks
from tests.host.canmon.output.mutations import page_of_blocks, page_of_records
from tests.soak import examples
from tickrig.host.canmon.model.check import bus_frames, node_events
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.survey import Thinned
from tickrig.wire.can import CanFrame

NODES = (5, 6)
OBJECTS = ("646000", "416000", "416000", "416001", "042000", "001000", "171000", "181001")
STATES = ("3702", "3702", "3702", "0802", "4002")
SIZES = {1: "2F", 2: "2B", 3: "27", 4: "23"}


def _swapped(value: int) -> str:
    return value.to_bytes(4, "little").hex()


def poll(chance: Random, node: int) -> Iterator[str]:
    """Yield some exchanges, most of them with nothing new."""
    for _ in range(chance.randint(1, 12)):
        entry, state = chance.choice(OBJECTS), chance.choice(STATES)
        if chance.random() < 0.8:
            yield f"6{node:02X}#40{entry}00000000"
            if entry.startswith("416"):
                yield f"5{0x80 + node:02X}#4B{entry}{state}0000"
            else:
                yield f"5{0x80 + node:02X}#43{entry}{_swapped(chance.randrange(1_000))}"
        else:
            size = chance.randint(1, 4)
            yield f"6{node:02X}#{SIZES[size]}{entry}{'01' * size}{'00' * (4 - size)}"
            yield f"5{0x80 + node:02X}#60{entry}00000000"


def disturbed(chance: Random, node: int) -> Iterator[str]:
    """Yield something of a node that is no poll."""
    asks, answers = f"6{node:02X}#", f"5{0x80 + node:02X}#"
    yield from chance.choice(
        [
            [f"{asks}4064600000000000"],
            [f"{answers}4364600001000000"],
            [f"{asks}4041600000000000", f"{answers}8041600000000206"],
            [f"{asks}8064600000000405"],
            [f"{asks}4064600000000000"] * 2,
            [f"{asks}R", f"{asks}40", f"{answers}60646000"],
            # segments, and a block whose segments look like requests
            [
                *(f"{asks}4008100000000000", f"{answers}4108100008000000"),
                *(f"{asks}6000000000000000", f"{answers}0061626364656667"),
                *(f"{asks}7000000000000000", f"{answers}1D68000000000000"),
            ],
            [
                *(f"{asks}C001200000000000", f"{answers}A40120007F000000"),
                *(f"{asks}{number:02X}64600000000000" for number in range(1, 0x42)),
                *(f"{answers}6064600000000000", f"{answers}A2417F0000000000"),
            ],
            # the mapping of TPDO1, the CAN-IDs of EMCY and of another server
            [f"{asks}2F001A0000000000", f"{answers}60001A0000000000"],
            [f"{asks}23001A0110004160", f"{answers}60001A0100000000"],
            [f"{asks}2F001A0001000000", f"{answers}60001A0000000000"],
            [f"{asks}2314100086050000", f"{answers}6014100000000000"],
            [f"{asks}2301120106060000", f"{answers}6001120100000000"],
            [f"{asks}2301120286050000", f"{answers}6001120200000000"],
            [f"7{node:02X}#00"],
            [f"7{node:02X}#05"],
            [f"7{node:02X}#R", f"7{node:02X}#85"],
            [f"0{0x80 + node:02X}#1081110000000000"],
            [f"000#81{node:02X}"],
            ["000#0100"],
            [f"1{0x80 + node:02X}#{chance.choice(STATES)}"] * 3,
            [f"2{0x80 + node:02X}#0102", "080#"],
        ]
    )


def traffic(seed: int) -> list[Record]:
    """Return the frames of two nodes by chance, on one or two buses."""
    chance, at_us, records = Random(seed), 1_000_000, []
    spoiled, buses = chance.choice([0, 0, 0.02]), chance.choice([1, 1, 2])
    for _ in range(chance.randint(1, 30)):
        node = chance.choice(NODES)
        lines = [poll(chance, node) if chance.random() < 0.7 else disturbed(chance, node)]
        if chance.random() < 0.5:  # both nodes at once
            lines.append(poll(chance, sum(NODES) - node))
        channel = f"can{chance.randrange(buses)}"
        while lines:
            text = next(line := chance.choice(lines), None)
            if text is None:
                lines.remove(line)
                continue
            for _ in range(chance.choice([0, 2]) if chance.random() < spoiled else 1):
                at_us += chance.choice([100, 400, 400, 2_000, 60_000])
                at_us -= 5_000 * (chance.random() < spoiled)
                frame = CanFrame.parse(text)
                if frame.remote:
                    frame = frame._replace(remote_length=1)
                records.append(Record(at_us, channel, frame, chance.random() < 0.1))
    return records


@pytest.fixture(scope="module", autouse=True)
def all_in_columns() -> Iterator[None]:
    """Judge each log in columns, and thin out marks early."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Thinned.__init__, "__defaults__", (3,))
        yield


@settings(max_examples=examples(40))
@given(seed=st.integers(0, (1 << 32) - 1), size=st.sampled_from([7, 60, 10_000]))
def test_the_page_of_a_log_in_blocks_is_as_frame_by_frame(seed: int, size: int) -> None:
    records = traffic(seed)
    page = page_of_records(records)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bus_frames, "_MANY", 0)
        assert page_of_blocks(blocks(records, size)) == page


def test_a_large_log_of_sync_and_pdos_alone_is_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bus_frames, "_MANY", 0)
    texts = ("080#", "181#0100") * 3
    records = [Record(at, "can0", CanFrame.parse(text)) for at, text in enumerate(texts)]
    assert page_of_blocks(blocks(records, 4)) == page_of_records(records)


def test_a_client_that_polls_costs_no_more_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    decoded, take = list[str](), Decoder.take

    def noted(self: Decoder, record: Record) -> Decoded:
        decoded.append(str(record.frame))
        return take(self, record)

    texts = ["705#05", *["605#4064600000000000", "585#4364600001000000", "705#05"] * 1_000]
    records = [Record(n * 400, "can0", CanFrame.parse(text)) for n, text in enumerate(texts)]
    monkeypatch.setattr(bus_frames, "_MANY", 0)
    monkeypatch.setattr(Decoder, "take", noted)
    page_of_blocks(blocks(records, 10_000))
    polled = [text for text in decoded if not text.startswith("705")]
    # The first and the last, in the survey and for the findings, and the marks that are kept.
    assert 8 <= len(polled) < 100


def test_a_moved_sdo_server_is_looked_at_frame_by_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = list[int]()
    take = node_events.BusEvents.take

    def noted(self: node_events.BusEvents, row: int) -> None:
        taken.append(row)
        take(self, row)

    monkeypatch.setattr(node_events.BusEvents, "take", noted)
    monkeypatch.setattr(bus_frames, "_MANY", 0)
    moved = ["605#2301120106060000", "585#6001120100000000", "605#2301120286050000"]
    moved += ["585#6001120200000000"]
    polled = ["606#4064600000000000", "586#4364600001000000"] * 20
    texts = ["705#05", *moved, *polled]
    records = [Record(n * 400, "can0", CanFrame.parse(text)) for n, text in enumerate(texts)]
    page_of_blocks(blocks(records, 10_000))
    assert taken[-len(texts) :] == list(range(len(texts)))
