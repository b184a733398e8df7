"""pcapng written and read: by us, by scapy and by tshark; pcap read; what is cut or damaged."""

from __future__ import annotations

import random
import shutil
import struct
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.logs.test_log_lines import HEARDS
from tickrig.host.canmon.model.frames import AnyFrame, Record
from tickrig.host.canmon.model.logs.log_file import LogError, dropped, gone
from tickrig.host.canmon.model.logs.log_reader import LogReader, read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.canmon.model.logs.notation import parse_frame
from tickrig.host.canmon.model.logs.pcap import packet
from tickrig.wire.can import FD_LENGTHS, CanFrame, ErrorFrame, FdFrame

START_US = 1_700_000_000_000_000
FRAMES = [
    *("705#7F", "00000605#4000100000000000", "123#R5", "000#", "181#0011223344556677"),
    *("20000088#0000010000000000", "123##1AABB", "00000123##3" + "5A" * 64, "7FF##2"),
]
TSHARK = pytest.mark.skipif(
    not (shutil.which("tshark") and shutil.which("editcap")),
    reason="no tshark: apt-get install tshark",
)


def mixed() -> list[Record]:
    """Return frames of each kind and length, on two buses, received and sent."""
    chance = random.Random(18)
    frames: list[AnyFrame] = [parse_frame(text) for text in FRAMES] * 3
    frames += [FdFrame(0x100 + n, chance.randbytes(n), flags=n % 4) for n in FD_LENGTHS]
    frames += [CanFrame(0x200 + n, chance.randbytes(n)) for n in range(9)] * 4
    chance.shuffle(frames)
    return [
        Record(START_US + 997 * n, chance.choice(("can0", "vcan1")), frame, chance.random() < 0.2)
        for n, frame in enumerate(frames)
    ]


def written(path: Path, records: list[Record]) -> Path:
    log = write_log(path)
    for record in records:
        log.write(record)
    log.close()
    assert log.messages() == []
    return path


def read(path: Path) -> tuple[list[Record], LogReader]:
    reader = read_log(path)
    return list(reader), reader


@pytest.mark.parametrize("name", ["run.pcapng", "run.pcapng.gz"])
def test_what_is_written_is_read_again(name: str, tmp_path: Path) -> None:
    records, reader = read(written(tmp_path / name, mixed()))
    assert records == mixed()
    assert reader.tally.messages(name) == []


@given(records=st.lists(HEARDS, max_size=20))
def test_any_frames_are_read_again(records: list[Record]) -> None:
    with TemporaryDirectory() as folder:
        assert read(written(Path(folder, "run.pcapng"), records))[0] == records


def tshark(path: Path, *fields: str) -> list[list[str]]:
    words = ["tshark", "-r", str(path), "-T", "fields", "-E", "separator=|"]
    words += [word for field in fields for word in ("-e", field)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return [line.split("|") for line in done.stdout.splitlines()]


@TSHARK
def test_tshark_reads_what_we_write(tmp_path: Path) -> None:
    path = written(tmp_path / "run.pcapng", mixed())
    fields = (
        *("frame.time_epoch", "frame.interface_name", "frame.packet_flags_direction", "can.id"),
        *("can.flags.xtd", "can.flags.rtr", "can.flags.err", "can.len", "canfd.flags.brs"),
        *("canfd.flags.esi", "data.data"),
    )
    rows = tshark(path, *fields)
    assert len(rows) == len(mixed())
    for row, (at_us, channel, frame, sent) in zip(rows, mixed(), strict=True):
        stamp, name, direction, ident, extended, remote, error, length, brs, esi, data = row
        seconds, fraction = stamp.split(".")
        assert int(seconds) * 1_000_000 + int(fraction[:6]) == at_us
        assert (name, truth(direction and str(int(direction, 16) - 1))) == (channel, sent)
        assert truth(error) is isinstance(frame, ErrorFrame)
        assert int(length, 0) == (frame.dlc if isinstance(frame, CanFrame) else len(frame.data))
        if isinstance(frame, ErrorFrame):
            continue
        assert (int(ident), truth(extended)) == (frame.can_id, frame.extended)
        assert truth(remote) is frame.remote
        if isinstance(frame, FdFrame):
            assert (truth(brs), truth(esi)) == (frame.brs, frame.esi)
        assert not data or data.startswith(frame.data.hex())


def truth(text: str) -> bool:
    return text in ("1", "True")


@TSHARK
def test_we_read_what_tshark_and_editcap_write(tmp_path: Path) -> None:
    path = written(tmp_path / "a.pcapng", mixed())
    subprocess.run(["tshark", "-r", path, "-w", tmp_path / "b.pcapng"], check=True)
    assert read(tmp_path / "b.pcapng")[0] == mixed()
    for kind in ("pcap", "nsecpcap"):
        subprocess.run(["editcap", "-F", kind, path, tmp_path / "c.pcap"], check=True)
        plain = [one._replace(channel="can0", sent=False) for one in mixed()]
        assert read(tmp_path / "c.pcap")[0] == plain


def test_scapy_reads_the_same_frames(tmp_path: Path) -> None:
    pytest.importorskip("scapy", reason="of the group dev")
    from scapy.layers.can import CAN, CANFD  # noqa: PLC0415 - may be missing
    from scapy.utils import PcapNgReader  # noqa: PLC0415

    path = written(tmp_path / "run.pcapng", mixed())
    with PcapNgReader(str(path)) as reader:
        packets = list(reader)
    assert len(packets) == len(mixed())
    for found, (at_us, _, frame, _) in zip(packets, mixed(), strict=True):
        assert round(found.time * 1_000_000) == at_us
        assert isinstance(found, CANFD if isinstance(frame, FdFrame) else CAN)
        if isinstance(frame, ErrorFrame):
            assert found.flags.error
            continue
        assert (found.identifier, bool(found.flags.extended)) == (frame.can_id, frame.extended)
        if not frame.remote:
            assert bytes(found.data)[: found.length] == frame.data
        if isinstance(frame, FdFrame):
            assert (
                bool(found.fd_flags.bit_rate_switch),
                bool(found.fd_flags.error_state_indicator),
            ) == (
                frame.brs,
                frame.esi,
            )


def block(order: str, kind: int, content: bytes) -> bytes:
    size = len(content) + 12
    return struct.pack(f"{order}II", kind, size) + content + struct.pack(f"{order}I", size)


def option(order: str, code: int, value: bytes) -> bytes:
    return struct.pack(f"{order}HH", code, len(value)) + value + bytes(-len(value) % 4)


def section(order: str) -> bytes:
    return block(order, 0x0A0D0D0A, struct.pack(f"{order}IHHq", 0x1A2B3C4D, 1, 0, -1))


def interface(order: str, link_type: int = 227, snap: int = 0, options: bytes = b"") -> bytes:
    return block(order, 1, struct.pack(f"{order}HHI", link_type, 0, snap) + options)


def enhanced(
    order: str, data: bytes, count: int = 1_500_000, number: int = 0, options: bytes = b""
) -> bytes:
    head = struct.pack(f"{order}5I", number, count >> 32, count & 0xFFFF_FFFF, len(data), len(data))
    return block(order, 6, head + data + bytes(-len(data) % 4) + options)


FRAME = CanFrame(0x705, b"\x7f")
PACKET = packet(FRAME)


def log(tmp_path: Path, *blocks: bytes) -> Path:
    path = tmp_path / "made.pcapng"
    path.write_bytes(b"".join(blocks))
    return path


@pytest.mark.parametrize("order", ["<", ">"])
def test_either_byte_order_is_read_with_its_options(order: str, tmp_path: Path) -> None:
    options = option(order, 2, b"can 7") + option(order, 9, b"\x09") + option(order, 0, b"")
    flags = option(order, 2, struct.pack(f"{order}I", 2)) + option(order, 1, b"a comment")
    drops = option(order, 4, struct.pack(f"{order}Q", 12))
    path = log(
        tmp_path,
        *(section(order), interface(order, options=options)),
        enhanced(order, PACKET, 1_500_000_999),
        block(order, 0x0BAD, b"unknown."),
        enhanced(order, packet(FdFrame(0x123, b"\x11" * 12, True, 1)), options=flags),
        enhanced(order, PACKET[:9], 2_000_000_000, options=drops),
    )
    records, reader = read(path)
    assert records == [
        Record(1_500_000, "can_7", FRAME),
        Record(1_500, "can_7", FdFrame(0x123, b"\x11" * 12, True, 1), sent=True),
        Record(2_000_000, "can_7", FRAME),
    ]
    assert reader.tally.messages("x") == ["x: its recorder lost 12 frames"]


@pytest.mark.parametrize(
    ("resolution", "count", "at_us"),
    [
        (b"\x03", 1_500, 1_500_000),
        (b"\x00", 7, 7_000_000),
        (b"\x8a", 1_536, 1_500_000),
        (b"\x0c", 1_500_000_999_999, 1_500_000),
        (b"\x7f", 5, 0),
        (b"\xff", 5, 0),
    ],
)
def test_times_of_any_resolution_are_read(
    resolution: bytes, count: int, at_us: int, tmp_path: Path
) -> None:
    options = option("<", 9, resolution)
    path = log(
        tmp_path, section("<"), interface("<", options=options), enhanced("<", PACKET, count)
    )
    assert [one.at_us for one in read(path)[0]] == [at_us]


def test_an_offset_of_seconds_is_added(tmp_path: Path) -> None:
    options = option("<", 14, struct.pack("<q", 1_700_000_000))
    path = log(tmp_path, section("<"), interface("<", options=options), enhanced("<", PACKET))
    assert [one.at_us for one in read(path)[0]] == [START_US + 1_500_000]


def test_simple_packets_have_the_time_of_the_one_before(tmp_path: Path) -> None:
    simple = block("<", 3, struct.pack("<I", 72) + PACKET)
    path = log(tmp_path, section("<"), interface("<", snap=16), enhanced("<", PACKET), simple)
    records, reader = read(path)
    assert records == [Record(1_500_000, "can0", FRAME)] * 2
    assert reader.tally.messages("x") == ["x: 1 frames have no time"]


def test_obsolete_packets_are_read(tmp_path: Path) -> None:
    head = struct.pack("<HH4I", 0, 3, 0, 1_500_000, 16, 16)
    path = log(tmp_path, section("<"), interface("<"), block("<", 2, head + PACKET))
    records, reader = read(path)
    assert (records, reader.tally.lost) == ([Record(1_500_000, "can0", FRAME)], 3)


def test_a_further_section_begins_anew(tmp_path: Path) -> None:
    names = [option(order, 2, name) for order, name in (("<", b"one"), (">", b"two"))]
    path = log(
        tmp_path,
        *(section("<"), interface("<", options=names[0]), enhanced("<", PACKET)),
        *(section(">"), interface(">", options=names[1]), enhanced(">", PACKET)),
    )
    assert [one.channel for one in read(path)[0]] == ["one", "two"]


@pytest.mark.parametrize(
    ("blocks", "said"),
    [
        ((interface("<", 1), enhanced("<", PACKET)), "x: 1 packets of other links passed over"),
        ((enhanced("<", PACKET),), "x: 1 packets that are no frames passed over"),
        ((interface("<"), enhanced("<", PACKET, number=1)), "x: 1 packets that are no frames"),
        ((interface("<"), enhanced("<", PACKET[:8])), "x: 1 packets that are no frames"),
        ((interface("<"), enhanced("<", PACKET, 10**18)), "x: 1 frames with an invalid time"),
        ((interface("<"), enhanced("<", b"")), "x: 1 packets that are no frames passed over"),
        ((interface("<"), block("<", 6, b"cut!")), "x: 1 packets that are no frames passed over"),
        ((interface("<"), enhanced("<", bytes(4) + b"\x80" + bytes(11))), "x: 1 CAN XL frames"),
        ((interface("<"), enhanced("<", bytes(4) + b"\x09" + bytes(12))), "x: 1 packets that are"),
    ],
)
def test_what_is_no_frame_is_counted(blocks: tuple[bytes, ...], said: str, tmp_path: Path) -> None:
    records, reader = read(log(tmp_path, section("<"), *blocks))
    assert (records, len(reader.tally.messages("x"))) == ([], 1)
    assert reader.tally.messages("x")[0].startswith(said)


def until_damage(path: Path) -> tuple[list[Record], str]:
    found: list[Record] = []
    try:
        for record in read_log(path):
            found.append(record)
    except LogError as error:
        return found, str(error)
    return found, ""


def test_a_capture_that_was_cut_anywhere_says_so_after_its_frames(tmp_path: Path) -> None:
    whole = written(tmp_path / "run.pcapng", mixed()[:12]).read_bytes()
    path, ends, counts = tmp_path / "cut.pcapng", 0, []
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        found, said = until_damage(path)
        ends += not said
        assert not said or said.startswith(str(path))
        assert found == mixed()[: len(found)]
        counts.append(len(found))
    assert (counts[-1], sorted(counts)) == (11, counts)
    assert ends == 14  # behind section, interfaces and frames: nothing is missing there


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (
            b"\x06\0\0\0" + struct.pack("<I", 8) + bytes(8),
            "it has a block of 8 bytes after 3 blocks",
        ),
        (
            b"\x06\0\0\0" + struct.pack("<I", 1 << 30) + bytes(8),
            "it has a block of 1073741824 bytes",
        ),
        (enhanced("<", PACKET)[:-4] + bytes(4), "it has a block whose sizes differ after 3 blocks"),
        (section("<")[:8] + b"abcd" + bytes(20), "it has a section of no byte order (61626364)"),
    ],
)
def test_damage_ends_it_after_all_frames_before(damage: bytes, said: str, tmp_path: Path) -> None:
    path = log(tmp_path, section("<"), interface("<"), enhanced("<", PACKET), damage)
    frames = iter(read_log(path))
    assert next(frames).frame == FRAME
    with pytest.raises(LogError) as caught:
        next(frames)
    assert str(caught.value).startswith(f"{path}: {said}")


@pytest.mark.parametrize("content", [b"", b"noise and more of it"])
def test_what_is_no_capture_is_refused(content: bytes, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="is no capture: it begins with"):
        read(log(tmp_path, content))


@pytest.mark.parametrize("order", ["<", ">"])
def test_pcap_of_either_order_and_resolution_is_read(order: str, tmp_path: Path) -> None:
    path = tmp_path / "run.pcap"
    for magic, fraction in ((0xA1B2C3D4, 250_000), (0xA1B23C4D, 250_000_999)):
        head = struct.pack(f"{order}IHHiIII", magic, 2, 4, 0, 0, 65_535, 227)
        one = struct.pack(f"{order}4I", 7, fraction, 16, 16) + PACKET
        path.write_bytes(head + one + one)
        assert read(path)[0] == [Record(7_250_000, "can0", FRAME)] * 2
        path.write_bytes(head + one + one[:-1])
        with pytest.raises(LogError, match="it is cut after 1 packets"):
            read(path)
    path.write_bytes(head[:10])
    with pytest.raises(LogError, match="it is cut in its header"):
        read(path)
    path.write_bytes(head + struct.pack(f"{order}4I", 7, 0, 1 << 30, 16))
    with pytest.raises(LogError, match="a packet of 1073741824 bytes behind 0 packets"):
        read(path)


def test_pcap_of_another_link_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "run.pcap"
    head = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, 1)
    path.write_bytes(head + struct.pack("<4I", 7, 0, 16, 16) + PACKET)
    records, reader = read(path)
    assert (records, reader.tally.unread) == ([], 0)
    assert reader.tally.passed_over == {"packets of other links": 1}


def test_pcap_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"pcap is read alone; a name in \.pcapng is written"):
        write_log(tmp_path / "run.pcap")


def test_marks_are_comments_and_what_was_lost_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "run.pcapng"
    writer = write_log(path)
    writer.write(Record(START_US, "can0", FRAME))
    writer.mark(dropped(START_US, 12))
    writer.write(Record(START_US + 1, "can0", FRAME))
    writer.mark(gone(START_US + 2, "can0", "Network is down"))
    writer.close()
    records, reader = read(path)
    assert (len(records), reader.tally.lost) == (2, 12)
    assert b"12 frames were lost" in path.read_bytes()
    assert b"can0 is gone: Network is down" in path.read_bytes()


@TSHARK
def test_tshark_shows_marks_as_comments(tmp_path: Path) -> None:
    path = tmp_path / "run.pcapng"
    writer = write_log(path)
    writer.mark(dropped(START_US, 12))
    writer.write(Record(START_US, "can0", FRAME))
    writer.close()
    assert tshark(path, "frame.comment") == [["12 frames were lost"]]
