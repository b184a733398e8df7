from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.can.can_bench import frames, some_frames
from tests.emulators.can.test_can_rig import Node
from tests.wire.candump_port import CandumpPort
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.record.recorder import CandumpFile
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import BIT_ERROR, CandumpError, ErrorFrame, LogLine, parse_line, parse_log
from tickrig.wire.instant import NEVER

errors = st.builds(ErrorFrame, st.integers(0, 0x1FFF_FFFF), st.binary(min_size=8, max_size=8))


@given(st.integers(0, 10**15), st.sampled_from(("can0", "vcan1", "a:b")), some_frames() | errors)
def test_what_was_written_is_read_back(at_us: int, channel: str, heard: ErrorFrame) -> None:
    line = LogLine(at_us, channel, heard)
    assert parse_log(f"{line}\n\n{line} R\r\n{line} T") == (line,) * 3


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("705#7F", "line 3 is not like '(0000000000.010000) vcan0 705#7F': '705#7F'"),
        ("(1.5) can0 705#7F", "line 3 is not like"),
        ("(1.000000) can0 705#7", "line 3: '705#7' is not a frame like"),
        ("(1.000000) can0 123##1AA", "line 3: '123##1AA' is not a frame like"),
        ("(1.000000) can0 800#", "line 3: CAN-ID 0x800 is not 11-bit"),
        ("(1.000000) can0 20000020#00", "line 3: '20000020#00' is not an error frame like"),
    ],
)
def test_a_wrong_line_is_told_with_its_number(text: str, reason: str) -> None:
    with pytest.raises(CandumpError) as raised:
        parse_line(text, 3)
    assert str(raised.value).startswith(reason)


def test_a_rig_is_recorded_with_its_error_frames(tmp_path: Path) -> None:
    wire, path = CanWire(), tmp_path / "run.log"
    file = CandumpFile(path)
    wire.observers.append(file.hear)
    node, _ = wire.end(), wire.end()
    wire.faults.arm("corrupt", "1")
    node.send(0, frames("705#7F"))
    wire.advance(wire.due_us)
    wire.faults.clear("corrupt")
    wire.advance(1_000)
    assert [line.received for line in parse_log(path.read_text())] == [BIT_ERROR, *frames("705#7F")]
    file.close()
    file.close()


def test_a_recording_that_cannot_go_on_warns_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "full"
    path.symlink_to("/dev/full")
    file = CandumpFile(path)
    for _ in range(2):
        file.hear(0, BIT_ERROR)
    file.close()
    assert "No space left" in file.error
    assert len(caplog.records) == 1


@pytest.mark.parametrize("channel", ["", "a b"])
def test_a_channel_is_a_name_without_blanks(channel: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is not a name without blanks"):
        CandumpFile(tmp_path / "log", channel)


def test_a_log_plays_a_device_the_same_frames_again(tmp_path: Path) -> None:
    path, wire = tmp_path / "run.log", CanWire()
    file, host, node = CandumpFile(path), wire.end(), Node(1, accepts=frozenset({0x80, 0x81}))
    wire.observers.append(file.hear)
    silence = CandumpPort(())
    rig = Rig(Station(node, wire.end()))
    for at_us in (3_400, 7_000, 9_950):
        rig.run_to(at_us)
        host.send(at_us, frames("080# 081#11"))
    rig.run_to(50_000)
    file.close()

    again = Node(1, accepts=frozenset({0x80, 0x81}))
    port = CandumpPort(parse_log(path.read_text()), lambda frame: frame.can_id != 0x201)
    replay = Rig(Station(again, port))
    replay.run_to(50_000)
    assert (again.heard, again.ticks) == (node.heard, node.ticks)
    assert [str(frame) for _, frame in port.sent] == ["201#0100", "201#0200"]
    assert (silence.due_us, silence.poll(0), port.due_us) == (NEVER, (), NEVER)


def test_a_log_may_begin_at_any_time() -> None:
    port = CandumpPort([LogLine(5_000_000, "can0", f) for f in frames("100#")], start_us=4_999_000)
    assert (port.due_us, port.poll(999), port.poll(1_000)) == (1_000, (), frames("100#"))
