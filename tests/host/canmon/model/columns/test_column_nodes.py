from __future__ import annotations

from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.column_log import blocks
from tests.host.canmon.model.decode.drive_trace import record as drive_trace
from tests.host.canmon.model.decode.test_noise import FRAMES
from tickrig.host.canmon.model.columns.column_meanings import ColumnNodes
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_board import (
    NodeBoard,
    NodeStatus,
    board_json,
    render_board,
)
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame, ErrorFrame

MAPPED = {
    5: EdsObjects(values={(0x1A00, 0): b"\2", (0x1A00, 1): bytes.fromhex("10004160"),
                          (0x1A00, 2): bytes.fromhex("20006460")}, name="drive"),
    9: EdsObjects(name="never heard"),
}  # fmt: skip
TOLD = [field.name for field in fields(NodeStatus) if field.name not in {"memory", "pdos"}]

Shown = tuple[list[str], list[str], list[list[object]]]


def shown(board: NodeBoard) -> Shown:
    rows = [[getattr(row, name) for name in TOLD] for row in board.rows()]
    return board_json(board, board.now_us), render_board(board, board.now_us, 300, 99), rows


def one_by_one(records: list[Record], eds: dict[int, EdsObjects]) -> Shown:
    decoder = Decoder(eds)
    board = NodeBoard(decoder, {node: found.name for node, found in eds.items()})
    for record in records:
        board.take(record, decoder.take(record))
    return shown(board)


def in_blocks(records: list[Record], eds: dict[int, EdsObjects], size: int) -> Shown:
    decoder = Decoder(eds)
    board = NodeBoard(decoder, {node: found.name for node, found in eds.items()})
    nodes = ColumnNodes(decoder, board)
    for block in blocks(records, size):
        nodes.take(block)
    return shown(board)


STATUSWORDS = st.sampled_from(["0000", "4000", "2100", "2300", "2700", "0800", "FF", ""])
TELLING = st.one_of(
    st.builds("185#{}{}".format, STATUSWORDS, st.sampled_from(["", "0A000000", "0A00"])),
    st.sampled_from(
        [
            *("705#00", "705#05", "705#85", "705#R", "000#8105", "000#0100", "000#8200", "185#R"),
            *("085#1081110000000000", "085#0000000000000000", "085#00"),
            *("605#4041600000000000", "585#4B41600027000000", "585#4B41600008000000"),
            *("605#2B41600000000000", "585#8041600002000106", "605#2F001A0000000000"),
            *("585#60001A0000000000", "605#2F001A0002000000", "605#23001A0110004160"),
            *("585#60001A0100000000", "605#2300180185020000", "585#6000180100000000", "285#2700"),
            *("605#2318140085000000", "585#6018140000000000", "206#0F00", "080#", "18500005#2700"),
        ]
    ).map(str),
).map(CanFrame.parse)


@pytest.mark.parametrize("size", [3, 1_000])
@given(
    frames=st.one_of(FRAMES, st.lists(TELLING, max_size=60)),
    steps_us=st.lists(st.integers(-1_000, 200_000), min_size=60, max_size=60),
    eds=st.sampled_from([{}, MAPPED]),
    bus_of=st.integers(1, 9),
)
def test_the_board_of_a_log_in_blocks_is_as_frame_by_frame(
    size: int,
    frames: list[CanFrame | ErrorFrame],
    steps_us: list[int],
    eds: dict[int, EdsObjects],
    bus_of: int,
) -> None:
    at_us, records = 1_000_000, []
    for number, (frame, step_us) in enumerate(zip(frames, steps_us, strict=False)):
        at_us += step_us
        if isinstance(frame, CanFrame) and frame.remote:
            frame = frame._replace(data=b"", remote_length=1)  # noqa: PLW2901 - as a log says it
        records.append(Record(max(0, at_us), f"can{number // bus_of % 2}", frame))
    assert in_blocks(records, eds, size) == one_by_one(records, eds)


@pytest.mark.parametrize("size", [1, 10, 50, 10_000])
def test_a_drive_that_is_configured_is_on_it_as_frame_by_frame(size: int) -> None:
    records = drive_trace()
    found = in_blocks(records, {}, size)
    assert found == one_by_one(records, {})
    assert '"node": 5' in found[0][0]


def test_frames_that_change_nothing_are_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    decoded, take = list[str](), Decoder.take

    def noted(self: Decoder, record: Record) -> Decoded:
        decoded.append(str(record.frame))
        return take(self, record)

    monkeypatch.setattr(Decoder, "take", noted)
    frames = ["080#", *["185#270000000000", "186#00", "705#05"] * 100]
    records = [Record(n * 1_000, "can0", CanFrame.parse(text)) for n, text in enumerate(frames)]
    in_blocks(records, MAPPED, 1_000)
    assert decoded == ["080#", *["705#05"] * 99, "185#270000000000", "186#00", "705#05"]
