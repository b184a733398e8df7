"""SDO dialogues mean the same in columns as frame by frame, whatever is lost or repeated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.column_log import blocks
from tests.host.canmon.model.columns.test_column_text import MARKS, said
from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tests.host.canmon.model.decode.test_noise import SDO
from tickrig.host.canmon.model.columns import column_meanings, column_sdo
from tickrig.host.canmon.model.columns.column_meanings import ColumnMeanings
from tickrig.host.canmon.model.decode.decoded import EDS
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, ObjectText
from tickrig.host.canmon.model.frames import Record, decoded_text
from tickrig.host.canmon.model.logs.log_writer import log_line
from tickrig.host.text.page_text import one_line
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.sdo_frame import crc16

OBJECTS = (0x1000, 0x1001, 0x1008, 0x1010, 0x1017, 0x1018, 0x1200, 0x1201, 0x1800, 0x1A00)
PLAIN = (0x2000, 0x2001, 0x2002, 0x2003, 0x2004, 0x2005, 0x2006, 0x6040, 0x6041, 0x6064)
TEXTS = {
    (0x2000, 0): ObjectText("a = 0x00", DataType.UNSIGNED32, " %s", source=EDS),
    (0x2001, 0): ObjectText("signed", DataType.INTEGER16, "mA", source=EDS),
    (0x2002, 0): ObjectText("scaled", DataType.INTEGER16, "V", 0.1, EDS),
    (0x2003, 0): ObjectText("real\n", DataType.REAL32, "\t", source=EDS),
    (0x2004, 0): ObjectText("flag", DataType.BOOLEAN, source=EDS),
    (0x2005, 0): ObjectText("text", DataType.VISIBLE_STRING, source=EDS),
    (0x2006, 0): ObjectText("odd", DataType.INTEGER24, "\N{DEGREE SIGN}", source=EDS),
}


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the fast way with the few frames that a test has."""
    monkeypatch.setattr(column_meanings, "_FEW", 1)
    monkeypatch.setattr(column_meanings, "_SETTLED", 2)
    monkeypatch.setattr(column_sdo, "_FEW", 2)


def assert_alike(
    records: Sequence[Record], size: int, eds: Mapping[int, EdsObjects] | None = None
) -> list[str]:
    """Compare the two ways, in blocks of so many frames; return the texts."""
    meanings, decoder = ColumnMeanings(Decoder(eds or {})), Decoder(eds or {})
    found = [
        text
        for block in blocks(list(records), size)
        for text in meanings.texts(block).lines(slice(None)).split("\n")[:-1]
    ]
    assert found == [one_line(decoded_text(decoder.take(record))) for record in records]
    return found


# Dialogues.


def frame(can_id: int, command: int, rest: bytes) -> CanFrame:
    return CanFrame(can_id, bytes((command & 0xFF,)) + rest.ljust(7, b"\0"))


class Speaker:
    """Writes the frames of transfers with a node."""

    def __init__(self, node: int, index: int, sub: int = 0) -> None:
        self.asks, self.answers = 0x600 + node, 0x580 + node
        self.entry = bytes((index & 0xFF, index >> 8, sub))

    def client(self, command: int, rest: bytes = b"") -> CanFrame:
        return frame(self.asks, command, rest)

    def server(self, command: int, rest: bytes = b"") -> CanFrame:
        return frame(self.answers, command, rest)

    def upload(self, value: bytes, *, sized: bool = True) -> list[CanFrame]:
        command = 0x43 | 4 - len(value) << 2 if sized else 0x42
        answer = self.server(command, self.entry + value)
        return [self.client(0x40, self.entry), answer]

    def download(self, value: bytes, *, sized: bool = True) -> list[CanFrame]:
        command = 0x23 | 4 - len(value) << 2 if sized else 0x22
        request = self.client(command, self.entry + value)
        return [request, self.server(0x60, self.entry)]

    def aborted(self, request: CanFrame, code: int) -> list[CanFrame]:
        return [request, self.server(0x80, self.entry + code.to_bytes(4, "little"))]

    def segments(self, value: bytes, size: int | None, *, upload: bool) -> list[CanFrame]:
        told = self.entry + (size or 0).to_bytes(4, "little")
        sized = 0 if size is None else 1
        if upload:
            frames = [self.client(0x40, self.entry), self.server(0x40 | sized, told)]
        else:
            frames = [self.client(0x20 | sized, told), self.server(0x60, self.entry)]
        parts = [value[at : at + 7] for at in range(0, len(value), 7)] or [b""]
        for number, part in enumerate(parts):
            toggle = number % 2 << 4
            head = toggle | 7 - len(part) << 1 | (number == len(parts) - 1)
            if upload:
                frames += [self.client(0x60 | toggle), self.server(head, part)]
            else:
                frames += [self.client(head, part), self.server(0x20 | toggle)]
        return frames

    def block(self, value: bytes, length: int, *, upload: bool) -> list[CanFrame]:
        size = value and self.entry + len(value).to_bytes(4, "little")
        sends, takes = (self.server, self.client) if upload else (self.client, self.server)
        if upload:
            begin = [self.client(0xA4, self.entry + bytes((length, 0)))]
            frames = [*begin, self.server(0xC6, size or self.entry), self.client(0xA3)]
        else:
            ready = self.server(0xA4, self.entry + bytes((length,)))
            frames = [self.client(0xC6, size or self.entry), ready]
        parts = [value[at : at + 7] for at in range(0, len(value), 7)] or [b""]
        for begins in range(0, len(parts), length):
            block = parts[begins : begins + length]
            for number, part in enumerate(block, 1):
                last = begins + number == len(parts)
                frames.append(sends(number | last << 7, part))
            frames.append(takes(0xA2, bytes((len(block), length))))
        end = crc16(value).to_bytes(2, "little")
        return [*frames, sends(0xC1 | 7 - len(parts[-1]) << 2, end), takes(0xA1)]


@st.composite
def dialogues(draw: st.DrawFn, node: int) -> list[CanFrame]:
    """Some transfers with a node; frames are lost, and come twice."""
    frames = list[CanFrame]()
    indices = st.sampled_from(draw(st.sampled_from((PLAIN, PLAIN, OBJECTS + PLAIN))))
    short, some = st.binary(min_size=1, max_size=4), st.binary(max_size=40)
    for _ in range(draw(st.integers(0, 8))):
        speaker = Speaker(node, draw(indices), draw(st.sampled_from((0, 0, 1))))
        match draw(st.integers(0, 7)):
            case 0 | 1:
                for value in draw(st.lists(short, min_size=1, max_size=4)):
                    frames += speaker.upload(value, sized=draw(st.booleans()))
            case 2:
                frames += speaker.download(draw(short), sized=draw(st.booleans()))
            case 3:
                requests = [speaker.upload(b"1"), speaker.download(b"123"), speaker.block(b"", 1,
                            upload=False), speaker.segments(b"", 3, upload=False)]  # fmt: skip
                request = draw(st.sampled_from(requests))[0]
                frames += speaker.aborted(request, draw(st.sampled_from((0x0602_0000, 7))))
            case 4 | 5 as way:
                value = draw(some)
                size = draw(st.sampled_from((len(value), len(value), None, 3)))
                frames += speaker.segments(value, size, upload=way == 4)
            case 6 | 7 as way:
                length = draw(st.sampled_from((1, 3, 127)))
                frames += speaker.block(draw(some), length, upload=way == 6)
    if draw(st.booleans()) and frames:
        for place in sorted(draw(st.sets(st.integers(0, len(frames) - 1), max_size=4)))[::-1]:
            short_one = CanFrame(0x600 + node, b"\x40")
            ways: tuple[list[CanFrame], ...] = [], [frames[place]] * 2, [short_one, frames[place]]
            frames[place : place + 1] = draw(st.sampled_from(ways))
    return frames


HEARTBEATS = st.sampled_from(["705#05", "705#00", "705#R", "706#00", "706#7F", "185#3702", "605#R"])
OTHERS = st.lists(st.one_of(SDO, HEARTBEATS.map(CanFrame.parse)), max_size=6)


@st.composite
def traffic(draw: st.DrawFn) -> list[Record]:
    """The dialogues of two nodes and other frames, mixed."""
    parts = [draw(dialogues(5)), draw(dialogues(6)), draw(OTHERS)]
    chance = draw(st.randoms(use_true_random=False))
    order = [number for number, part in enumerate(parts) for _ in part]
    chance.shuffle(order)
    at_us, records = 0, list[Record]()
    for number in order:
        at_us += chance.choice((0, 50, 150, 1_234, -40))
        records.append(Record(max(at_us, 0), "can0", parts[number].pop(0)))
    return records


@given(records=traffic(), size=st.sampled_from((1, 7, 50, 1_000)), named=st.booleans())
def test_dialogues_mean_the_same_in_columns(records: list[Record], size: int, named: bool) -> None:
    eds = {5: EdsObjects(TEXTS), 6: EdsObjects(TEXTS)} if named else {}
    assert_alike(records, size, eds)


def test_a_transfer_of_another_node_does_not_end_one_that_goes_on() -> None:
    frames = [
        CanFrame(0x606, bytes.fromhex("4000200000000000")),
        *(CanFrame(0x605, bytes.fromhex("4000200000000000")),) * 2,
        CanFrame(0x585, bytes.fromhex("410020000F000000")),
        CanFrame(0x605, bytes.fromhex("6000000000000000")),
        CanFrame(0x586, bytes.fromhex("4200200000000000")),
        CanFrame(0x585, bytes.fromhex("0000100000000000")),
    ]
    assert assert_alike(at_each_ms(frames), 7)[0] == "6 sdo upload of 2000h:00 asked for"


WORDS = (
    *((), ("-x", "-t", "d"), ("--to", "0.01"), ("--from", "0.005"), ("-F", "sdo")),
    *(("-F", "node=5 and not heartbeat"), ("--jsonl",)),
)


@given(words=st.sampled_from(WORDS), records=traffic(), data=st.data())
def test_a_log_is_shown_alike(
    words: tuple[str, ...], records: list[Record], data: st.DataObject
) -> None:
    lines = [log_line(record) for record in records]
    for mark in data.draw(st.lists(MARKS, max_size=3)):
        lines.insert(data.draw(st.integers(0, len(lines))), mark)
    with TemporaryDirectory() as folder:
        path = Path(folder, "run.log")
        path.write_text("\n".join(lines), "ascii")
        assert said(0, "dump", path, *words) == said(1 << 30, "dump", path, *words)


@pytest.mark.parametrize("dbc", [(), ("--dbc", str(GOLDEN / "engine.dbc"))])
@pytest.mark.parametrize("name", ["drive.log", "noise.log"])
def test_sample_logs_are_shown_alike(name: str, dbc: tuple[str, ...]) -> None:
    path = GOLDEN / name
    assert said(0, "dump", path, *dbc) == said(1 << 30, "dump", path, *dbc)


def at_each_ms(frames: Sequence[CanFrame]) -> list[Record]:
    return [Record(1_000 * number, "can0", one) for number, one in enumerate(frames)]


@pytest.mark.parametrize("size", [1, 2, 3, 5, 64, 1_000])
@pytest.mark.parametrize("upload", [False, True])
def test_a_transfer_goes_on_in_the_next_block(size: int, upload: bool) -> None:
    value = bytes(range(200))
    speaker = Speaker(5, 0x2000)
    frames = speaker.segments(value, 200, upload=upload) + speaker.block(value, 12, upload=upload)
    texts = assert_alike(at_each_ms(frames * 2), size)
    assert texts[2].startswith("5 sdo asks for" if upload else "5 sdo segment of 7 B")
    assert sum("200 B" in text and "block, " in text for text in texts) == 2


def test_an_answer_that_comes_twice_is_known_again_behind_a_chain() -> None:
    """A transfer that was repeated is the latest one, until others end."""
    upload = Speaker(5, 0x2000).upload(b"abcd")
    frames = [*upload, upload[0], *upload, upload[1], *upload * 3, upload[1]]
    texts = assert_alike(at_each_ms(frames), 1_000)
    assert texts[5] == "5 sdo answered again"
    assert "request missing" not in texts[5]


def test_a_client_that_polls_a_statusword_makes_its_node_a_drive() -> None:
    """From the first one on, objects have the names of CiA 402."""
    position, word = Speaker(5, 0x6064).upload(b"abcd"), Speaker(5, 0x6041).upload(b"\x37\x02")
    texts = assert_alike(at_each_ms([*position * 3, *word * 3, *position * 3]), 1_000)
    assert "position" not in texts[5]
    assert "position_actual_value" in texts[-1]


@pytest.mark.parametrize("kind", [*DataType, None])
def test_values_of_each_type_mean_the_same_in_columns(kind: DataType | None) -> None:
    values = [b"\0", b"\xff", b"\x80", b"\x01\x02", b"\xff\xff", b"\0\x80", b"abc", b"\xff\xff\xff"]
    values += [
        b"\0\0\0\0",
        b"\xff" * 4,
        b"\0\0\0\x80",
        b"\x01\0\0\0",
        b"\x80\xff\xff\xff",
        b"12\0\0",
    ]
    frames = list[CanFrame]()
    for sub in range(3):
        speaker = Speaker(5, 0x2000, sub)
        for value in values * 3:
            frames += speaker.upload(value) + speaker.download(value)
            frames += speaker.upload(value.ljust(4, b"\x05"), sized=False)
            frames += speaker.download(value.ljust(4, b"\0"), sized=False)
            frames += speaker.aborted(speaker.download(value)[0], 0x0609_0030)
    texts = {
        (0x2000, 0): ObjectText("x", kind, "", source=EDS),
        (0x2000, 1): ObjectText("x", kind, "h", in_hex=True, source=EDS),
        (0x2000, 2): ObjectText("x", kind, "V", 0.01, EDS),
    }
    assert_alike(at_each_ms(frames), 1_000, {5: EdsObjects(texts)})
