from __future__ import annotations

import logging
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.lamp import Lamp
from tickrig.emulators.record.recorder import TracedDevice, TraceFile
from tickrig.emulators.record.replay import RecordedRun, ReplayDifference, read_recording, replay
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.emulator import Emulator
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.text.trace import Header, Mark, Record, TraceError, parse_record

HEADER = '# tickrig-trace v1 lamp {"seed": 0}\n'
HEARD = r"""0.001000 < hi\n
0.002000 > ab\xff
0.002000 < ab\xff
0.005000 ! key=1
0.005000 ! x_mm=-3
0.005000 < click\n
0.009000 .
"""


def record(path: Path, *, device: Emulated[bytes] | None = None, close: bool = True) -> str:
    trace = TraceFile(path, Header("lamp", {"seed": 0}))
    emulator = Emulator("lamp", device or Lamp(), trace=trace)
    emulator.event_queue.put(1, 1_100, lambda now_us: emulator.send(now_us, b"ab\xff"))
    emulator.event_queue.put(2, 4_100, lambda now_us: emulator.operator.set("key", 1))
    emulator.event_queue.put(3, 4_200, lambda now_us: emulator.operator.set("x_mm", -3))
    emulator.event_queue.put(4, 9_001, lambda now_us: emulator.stop())
    while emulator.running:
        emulator.step()
    if close:
        emulator.close()
    return path.read_text()


def reading(text: str) -> RecordedRun:
    return read_recording(text.encode())


def test_a_recorded_run_reads_like_this(tmp_path: Path) -> None:
    assert record(tmp_path / "t") == HEADER + HEARD


def test_a_recorded_run_replays_identically(tmp_path: Path) -> None:
    recording = reading(record(tmp_path / "t"))
    assert recording.ended
    assert recording.ticks == 3
    assert replay(recording, Lamp()) is None


@given(st.lists(st.tuples(st.integers(0, 9_000), st.binary(max_size=9)), max_size=9))
def test_any_run_replays_identically(
    tmp_path_factory: pytest.TempPathFactory, sent: list[tuple[int, bytes]]
) -> None:
    path = tmp_path_factory.mktemp("trace") / "t"
    trace, line = TraceFile(path, Header("lamp")), SerialLine()
    device = TracedDevice(Lamp(), trace)
    rig = Rig(Station(device, line.a))
    for delay_us, data in sent:
        rig.run_for(delay_us)
        line.b.send(rig.now_us, data)
        device.inputs.set("x_mm", len(data))
    rig.run_for(9_000)
    trace.close(rig.now_us)
    assert replay(read_recording(path.read_bytes()), Lamp()) is None


def test_a_reset_is_recorded_and_replayed(tmp_path: Path) -> None:
    trace, line = TraceFile(tmp_path / "t", Header("lamp")), SerialLine()
    device = TracedDevice(Lamp(), trace)
    rig = Rig(Station(device, line.a))
    rig.run_to(5_500)
    device.reset()
    rig.run_to(9_000)
    trace.close(rig.now_us)
    text = (tmp_path / "t").read_text()
    assert text.endswith("0.006000 ! reset\n0.006000 < hi\\n\n0.009000 .\n")
    assert replay(reading(text), Lamp()) is None


@pytest.mark.parametrize(
    ("old", "new", "difference"),
    [
        (r"< ab\xff", r"< ab", ReplayDifference(2_000, b"ab", b"ab\xff", 4)),
        (r"0.005000 < click\n", r"0.006000 < click\n", ReplayDifference(5_000, b"", b"click\n", 0)),
        ("0.001000 < hi\\n\n", "", ReplayDifference(1_000, b"", b"hi\n", 0)),
        (
            "0.009000 .",
            "0.008000 < more\\n\n0.009000 .",
            ReplayDifference(8_000, b"more\n", b"", 8),
        ),
        ("0.005000 ! key=1\n", "", ReplayDifference(5_000, b"click\n", b"", 6)),
    ],
)
def test_the_first_difference_is_found(
    old: str, new: str, difference: ReplayDifference[bytes]
) -> None:
    text = (HEADER + HEARD).replace(old, new)
    assert text != HEADER + HEARD
    assert replay(reading(text), Lamp()) == difference


def test_another_device_is_seen_to_differ() -> None:
    difference = replay(reading(HEADER + HEARD), Lamp(b"hello\n"))
    assert difference == ReplayDifference(1_000, b"hi\n", b"hello\n", 2)


def test_a_killed_writer_costs_the_last_tick_only(tmp_path: Path) -> None:
    whole = record(tmp_path / "t", close=False)
    for size in range(len(whole), len(HEADER) - 1, -1):
        recording = reading(whole[:size])
        assert not recording.ended
        assert replay(recording, Lamp()) is None
    assert reading(whole).ticks == 2


def test_each_tick_is_on_disk_at_once(tmp_path: Path) -> None:
    trace = TraceFile(tmp_path / "t", Header("lamp"))
    trace.write([Record(1_000, Mark.TO_DEVICE, b"a")])
    assert (tmp_path / "t").read_text().endswith("0.001000 > a\n")
    trace.close(2_000)


def test_a_full_disk_is_said_once_and_the_emulator_goes_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    trace = TraceFile(Path("/dev/full"), Header("lamp"))
    emulator = Emulator("lamp", Lamp(), trace=trace)
    emulator.event_queue.put(1, 2_000, lambda now_us: emulator.send(now_us, b"ab\n"))
    emulator.event_queue.put(2, 9_000, lambda now_us: emulator.stop())
    while emulator.running:
        emulator.step()
    emulator.close()
    assert [line.data for line in emulator.log.since(0)] == [b"hi", b"ab", b"ab"]
    assert [(r.levelno, r.getMessage()) for r in caplog.records] == [
        (
            logging.WARNING,
            "recording ended: /dev/full: No space left on device; the emulator goes on",
        )
    ]
    assert emulator.status()["trace_error"] == "/dev/full: No space left on device"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "not a trace: it is empty"),
        ("# tickrig-", "line 1 is cut off: the header of the trace has no end"),
        ('# tickrig-trace v1 lamp {"a', "line 1 is cut off: the header of the trace has no end"),
        ("hello\n", "line 1 is not"),
        ("# tickrig-trace v2 lamp {}\n", "version 2; versions 1 and 2 are known"),
        ("# tickrig-trace v1 lamp {,}\n", "the configuration is not JSON"),
        (HEADER + "0.1 > x\n", "line 2 is not 'SECONDS MARK TEXT'"),
        (HEADER + "0.001000 ? x\n", "line 2 is not"),
        (HEADER + "0.001000 ! key\n", "line 2: 'key' is not NAME=VALUE"),
        (HEADER + "0.001000 > \\q\n", "line 2: .* is not ASCII"),
        (HEADER + "0.002000 > a\n0.001000 > a\n", "line 3 is earlier"),
        (HEADER + "0.002000 .\n0.003000 > a\n", "behind the end"),
        (HEADER + "0.002000 > \u00e9\n", "byte [0-9]+ is not ASCII"),
    ],
)
def test_what_is_no_trace_is_refused(text: str, error: str) -> None:
    with pytest.raises(TraceError, match=error):
        reading(text)


@pytest.mark.parametrize("change", ["nope=1", "x_mm=99"])
def test_an_input_that_the_device_does_not_have_is_refused(change: str) -> None:
    text = HEADER + f"0.001000 ! {change}\n0.002000 .\n"
    with pytest.raises(TraceError, match="line 2: "):
        replay(reading(text), Lamp())


@given(
    st.integers(0, 10**12),
    st.sampled_from([Mark.TO_DEVICE, Mark.FROM_DEVICE]),
    st.binary(min_size=1),
)
def test_a_record_comes_back(at_us: int, mark: Mark, data: bytes) -> None:
    record = Record(at_us, mark, data, line=7)
    assert parse_record(record.encode(), 7) == record


def test_nobody_can_tell_a_recorded_device(tmp_path: Path) -> None:
    lamp = Lamp()
    traced = TracedDevice(lamp, TraceFile(tmp_path / "t", Header("lamp")))
    assert traced.tick_us == lamp.tick_us
    assert traced.due_us == lamp.due_us
    assert traced.inputs is lamp.inputs
    assert traced.outputs is lamp.outputs
    assert traced.read("state") == "Lit"


@pytest.mark.parametrize("value", [5e-324, 1e-07, -2.5e-115, 1e22])
def test_any_fraction_that_is_recorded_is_read(value: float) -> None:
    line = Record(1_000, Mark.PHYSICAL, text=f"x_m={value}").encode()
    assert parse_record(line, 2).change == ("x_m", value)
