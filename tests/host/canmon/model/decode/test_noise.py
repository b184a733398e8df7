"""Any traffic: nothing raises, and a log cut anywhere is decoded all the same."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.decode.drive_trace import record
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_board import NodeBoard, board_json, render_board
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.sources.line_source import RrcLines, RtcLiteLine
from tickrig.wire.can import CanFrame, ErrorFrame, data_frame

CAN_IDS = st.sampled_from((0x000, 0x080, 0x085, 0x100, 0x185, 0x205, 0x585, 0x605, 0x705, 0x7E4))
COMMANDS = st.sampled_from(range(0x100))
OBJECTS = st.sampled_from((0x1000, 0x1005, 0x1014, 0x1017, 0x1201, 0x1800, 0x1A00, 0x6041, 0x2000))
SDO = st.builds(
    lambda can_id, command, index, sub, rest: CanFrame(
        can_id, bytes((command, index & 0xFF, index >> 8, sub)) + rest
    ),
    st.sampled_from((0x585, 0x605)),
    COMMANDS,
    OBJECTS,
    st.integers(0, 3),
    st.binary(min_size=4, max_size=4),
)
ANY = st.builds(data_frame, st.one_of(CAN_IDS, st.integers(0, 0x7FF)), st.binary(max_size=8))
REMOTE = st.builds(lambda can_id: CanFrame(can_id, remote=True), CAN_IDS)
WIDE = st.builds(lambda data: CanFrame(0x18FF_0000, data, extended=True), st.binary(max_size=8))
ERRORS = st.builds(ErrorFrame, st.integers(0, 0x1FFF_FFFF), st.binary(min_size=8, max_size=8))
FRAMES = st.lists(st.one_of(SDO, SDO, ANY, REMOTE, WIDE, ERRORS), max_size=60)


def watch(frames: list[Record]) -> NodeBoard:
    """Decode frames, and show what comes of them."""
    decoder = Decoder()
    board = NodeBoard(decoder)
    for item in frames:
        board.take(item, decoder.take(item))
    decoder.pending(board.now_us)
    lines = render_board(board, board.now_us, 80, 24)
    assert len(lines) <= 24
    assert all(len(line) <= 80 for line in lines)
    assert len(board_json(board, board.now_us)) == len(board.rows())
    return board


@given(FRAMES)
def test_any_frames_are_decoded_or_said_to_be_wrong(frames: list[CanFrame | ErrorFrame]) -> None:
    watch([Record(number, "can0", frame) for number, frame in enumerate(frames)])


@given(st.data())
def test_a_trace_with_holes_is_decoded(data: st.DataObject) -> None:
    frames = record()
    begin = data.draw(st.integers(0, len(frames)))
    lost = data.draw(st.sets(st.integers(0, len(frames)), max_size=20))
    left = [item for number, item in enumerate(frames) if number >= begin and number not in lost]
    watch(left)


@given(st.lists(st.tuples(st.booleans(), st.binary(max_size=40)), max_size=20))
def test_any_bytes_of_a_serial_line_are_decoded(chunks: list[tuple[bool, bytes]]) -> None:
    rrc, rtc_lite = RrcLines("ttyS0"), RtcLiteLine("ttyS1")
    for number, (to_device, data) in enumerate(chunks):
        for found in (
            *rrc.take(number * 30_000, data, to_device=to_device),
            *rtc_lite.take(number * 30_000, data, to_device=to_device),
        ):
            assert found.decoded.kind in ("rrc", "rtc-lite")
