from __future__ import annotations

import copy
import io
import pickle
from collections.abc import Callable
from typing import Any

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.serial.outside.lines import BAUD, OpenLine, echo, rig_of
from tickrig.emulators.rig.sim_waits import MOST_LOOKS
from tickrig.emulators.serial.outside.serial_side import LONGEST_US
from tickrig.emulators.serial.outside.sim_serial import SimSerial

FRAME_US = 10 * 1_000_000 // BAUD


def test_a_byte_is_read_when_its_stop_bit_has_passed() -> None:
    bench = OpenLine(timeout=1)
    bench.at(5_000, b"ab")
    assert (bench.port.read(), bench.rig.now_us) == (b"a", 5_100)
    assert (bench.port.read(5), bench.rig.now_us) == (b"b", 1_005_100)


@pytest.mark.parametrize("timeout", [0.000_001, 0.25, 2, 3_599])
def test_reading_nothing_takes_exactly_the_timeout(timeout: float) -> None:
    bench = OpenLine(timeout=timeout)
    bench.rig.run_for(123)
    assert bench.port.read(10) == b""
    assert bench.rig.now_us == 123 + round(timeout * 1e6)


def test_without_waiting_no_time_passes() -> None:
    bench = OpenLine(timeout=0)
    bench.far.send(0, b"abc")
    assert bench.port.read(10) == b""
    bench.rig.run_for(250)
    assert (bench.port.in_waiting, bench.port.read(10), bench.port.read()) == (2, b"ab", b"")
    assert bench.rig.now_us == 250


def test_the_timeout_is_that_of_the_whole_read() -> None:
    bench = OpenLine(timeout=0.01)
    for number in range(5):
        bench.at(3_000 * number, b"x")
    assert (bench.port.read(5), bench.rig.now_us) == (b"xxxx", 10_000)


def test_a_gap_ends_no_read_as_with_pyserial_on_linux() -> None:
    bench = OpenLine(timeout=1, inter_byte_timeout=0.002)
    bench.at(10_000, b"abc")
    bench.at(13_000, b"d")
    assert (bench.port.read(5), bench.rig.now_us) == (b"abcd", 1_000_000)


def test_without_a_timeout_it_waits_as_long_as_it_takes() -> None:
    bench = OpenLine()
    bench.at(1_800_000_000, b"x")
    assert (bench.port.read(), bench.rig.now_us) == (b"x", 1_800_000_100)


def test_a_wait_for_ever_is_told_after_an_hour() -> None:
    bench = OpenLine()
    with pytest.raises(serial.SerialException, match="nothing came for an hour, and no timeout"):
        bench.port.read()
    assert bench.rig.now_us == LONGEST_US


@pytest.mark.parametrize(
    "look",
    [lambda port: port.in_waiting, lambda port: port.read(), lambda port: port.cts],
    ids=["in_waiting", "read", "cts"],
)
def test_looking_for_ever_is_told(look: Callable[[SimSerial], object]) -> None:
    bench = OpenLine(timeout=0)
    for _ in range(3):
        for _ in range(MOST_LOOKS):
            assert not look(bench.port)
        bench.rig.run_for(1)
    with pytest.raises(serial.SerialException, match=r"looked 10000 times at 0\.000003 s: looking"):
        all(not look(bench.port) for _ in range(2 * MOST_LOOKS))


def test_lines_are_read_as_files_are() -> None:
    bench = OpenLine(timeout=0.5)
    bench.far.send(0, b"one\ntwo\nthr")
    with bench.port as port:
        assert port.readline() == b"one\n"
        assert (list(port), bench.rig.now_us) == ([b"two\n", b"thr"], 1_001_100)
    with pytest.raises(serial.PortNotOpenError):
        bench.port.readline()


def test_until_a_sequence_comes_or_the_time_is_over() -> None:
    bench = OpenLine(timeout=0.5)
    bench.far.send(0, b"one\r\ntwo>three")
    assert bench.port.read_until(b"\r\n") == b"one\r\n"
    assert bench.port.read_until(b">", size=2) == b"tw"
    assert bench.port.read_until(b">") == b"o>"
    assert (bench.port.read_until(), bench.rig.now_us) == (b"three", 1_400 + 500_000)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_text_and_buffers_may_be_put_around_it() -> None:
    bench = OpenLine(timeout=0.1)
    bench.far.send(0, "grüß\r\ngott\r\n".encode())
    text = io.TextIOWrapper(io.BufferedRWPair(bench.port, bench.port), encoding="utf-8")  # type: ignore[type-var]
    assert text.readline() == "grüß\n"
    text.write("danke\n")
    text.flush()
    bench.port.flush()
    assert bench.heard() == b"danke\n"
    del text  # it flushes the port that its reader has closed: reported since Python 3.13


def test_what_is_written_is_at_the_device_when_flush_returns() -> None:
    bench = OpenLine()
    assert bench.port.write(b"0123456789") == 10
    assert (bench.rig.now_us, bench.port.out_waiting) == (0, 10)
    bench.rig.run_for(250)
    assert (bench.heard(), bench.port.out_waiting) == (b"01", 8)
    bench.port.flush()
    assert (bench.heard(), bench.rig.now_us, bench.port.out_waiting) == (b"23456789", 1_000, 0)


@pytest.mark.parametrize("data", [bytearray(b"ab"), memoryview(b"ab"), b"ab", [97, 98]])
def test_bytes_of_any_kind_are_written(data: Any) -> None:
    bench = OpenLine()
    assert bench.port.write(data) == 2
    bench.port.flush()
    assert bench.heard() == b"ab"


def test_text_is_refused_as_pyserial_does() -> None:
    with pytest.raises(TypeError, match="unicode strings are not supported"):
        OpenLine().port.write("ab")  # type: ignore[arg-type]


def test_a_write_waits_for_room() -> None:
    bench = OpenLine(buffer_bytes=100)
    assert bench.port.write(bytes(range(150))) == 150
    assert 5_000 <= bench.rig.now_us <= 5_002
    heard = bench.heard()
    bench.port.flush()
    assert (heard + bench.heard(), bench.rig.now_us) == (bytes(range(150)), 15_000)


def test_a_long_write_loses_nothing_while_the_device_reads() -> None:
    port, data = echo(timeout=1), bytes(range(256)) * 40
    heard = b""
    for start in range(0, len(data), 3_000):
        assert port.write(data[start : start + 3_000]) == len(data[start : start + 3_000])
        heard += port.read_all()
    assert heard + port.read(len(data) - len(heard)) == data


def test_a_write_that_has_not_the_time_is_told() -> None:
    bench = OpenLine(buffer_bytes=100, write_timeout=0.001)
    with pytest.raises(serial.SerialTimeoutException, match="Write timeout"):
        bench.port.write(bytes(150))
    assert bench.rig.now_us == 1_000
    assert bench.port.out_waiting == 100


def test_a_write_that_may_not_wait_says_how_much_it_took() -> None:
    bench = OpenLine(buffer_bytes=100, write_timeout=0)
    assert bench.port.write(bytes(150)) == 100
    assert (bench.port.write(b"x"), bench.rig.now_us) == (0, 0)


def test_a_write_to_a_device_that_takes_nothing_ends_too() -> None:
    bench = OpenLine(buffer_bytes=100)
    with pytest.raises(serial.SerialException, match="nothing came for an hour"):
        bench.port.write(bytes(1_000))


def test_what_has_not_begun_can_be_taken_back() -> None:
    bench = OpenLine()
    bench.port.write(b"0123456789")
    bench.rig.run_for(250)
    bench.port.reset_output_buffer()
    bench.port.write(b"x")
    bench.port.flush()
    assert (bench.heard(), bench.rig.now_us) == (b"012x", 400)


def test_what_has_come_can_be_forgotten() -> None:
    bench = OpenLine(timeout=0.01)
    bench.far.send(0, b"0123456789")
    bench.rig.run_for(250)
    assert bench.port.in_waiting == 2
    bench.rig.run_for(100)
    bench.port.reset_input_buffer()
    assert bench.port.read(10) == b"3456789"


def test_a_read_can_be_cancelled_while_it_waits() -> None:
    bench = OpenLine(timeout=10)
    bench.at(1_000, b"a")
    bench.rig.event_queue.put("cancel", 5_000, lambda now_us: bench.port.cancel_read())
    assert (bench.port.read(2), bench.rig.now_us) == (b"a", 4_999)  # before the tick of 5 ms
    assert (bench.port.read(2), bench.rig.now_us) == (b"", 10_004_999)


def test_a_write_can_be_cancelled_while_it_waits() -> None:
    bench = OpenLine(buffer_bytes=100)
    bench.rig.event_queue.put("cancel", 5_000, lambda now_us: bench.port.cancel_write())
    assert 140 <= bench.port.write(bytes(1_000)) <= 160
    assert bench.rig.now_us == 4_999  # an action is done before the tick of its time


def test_a_read_ends_when_the_port_is_closed_under_it() -> None:
    bench = OpenLine(timeout=10)
    bench.at(1_000, b"a")
    bench.rig.event_queue.put("close", 5_000, lambda now_us: bench.port.close())
    assert (bench.port.read(2), bench.rig.now_us) == (b"a", 4_999)


def test_a_host_that_does_not_read_loses_what_the_buffers_do_not_hold() -> None:
    bench = OpenLine(timeout=0, buffer_bytes=100)
    for start_us in range(0, 100_000, 10_000):
        bench.at(start_us, bytes(100))
    bench.rig.run_for(200_000)
    assert (bench.port.in_waiting, bench.line.b.lost) == (100, 900)


def test_in_waiting_does_not_grow_for_ever() -> None:
    bench = OpenLine(timeout=0)
    for number in range(20):
        bench.at(50_000 * number, bytes(500))
    for _ in range(20):
        bench.rig.run_for(50_000)
        assert bench.port.in_waiting <= 4_096 + 500
    bench.rig.run_for(1_000_000)
    assert [len(bench.port.read_all()) for _ in range(3)] == [4_500, 4_096, 0]
    assert bench.line.b.lost == 1_404


def test_a_closed_port_refuses_all_as_pyserial_does() -> None:
    bench = OpenLine()
    bench.port.close()
    bench.port.close()
    calls: list[Callable[[], object]] = [
        bench.port.read,
        lambda: bench.port.write(b"x"),
        lambda: bench.port.in_waiting,
        lambda: bench.port.out_waiting,
        bench.port.flush,
        bench.port.reset_input_buffer,
        bench.port.reset_output_buffer,
        bench.port.send_break,
        lambda: bench.port.cts,
    ]
    for call in calls:
        with pytest.raises(serial.PortNotOpenError, match="Attempting to use a port that is not"):
            call()
    bench.port.cancel_read()
    bench.port.cancel_write()
    assert not bench.port.is_open


def test_what_came_before_the_port_was_opened_is_forgotten() -> None:
    bench = OpenLine(timeout=0.001)
    bench.port.close()
    bench.far.send(0, b"early")
    bench.rig.run_for(1_000)
    with bench.port as port:
        assert port.read(5) == b""


def test_one_line_has_one_host() -> None:
    bench = OpenLine()
    with pytest.raises(serial.SerialException, match="could not open port rig: another host has"):
        SimSerial(bench.side)
    with pytest.raises(serial.SerialException, match="Port is already open"):
        bench.port.open()
    bench.port.close()
    SimSerial(bench.side).close()
    SimSerial(bench.side)  # nobody keeps it: it is closed
    SimSerial(bench.side, port="again")


def test_a_port_without_a_line_says_so() -> None:
    port = SimSerial.__new__(SimSerial)
    port._begin()
    with pytest.raises(serial.SerialException, match="Port must be configured"):
        port.open()
    with pytest.raises(serial.PortNotOpenError):
        port.read()


def test_there_is_no_file_descriptor() -> None:
    with pytest.raises(io.UnsupportedOperation, match="rig: a port in virtual time has no file"):
        OpenLine().port.fileno()


def test_settings_that_are_not_given_are_those_of_the_device() -> None:
    port = OpenLine(timeout=3).port
    assert port.get_settings() == {
        **{"baudrate": BAUD, "bytesize": 8, "parity": "N", "stopbits": 1, "timeout": 3},
        **{"xonxoff": False, "rtscts": False, "dsrdtr": False},
        **{"write_timeout": None, "inter_byte_timeout": None},
    }
    assert repr(port).startswith("SimSerial<id=0x")


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"baudrate": 0}, "Invalid baud rate: 0"),
        ({"baudrate": -1}, "Not a valid baudrate: -1"),
        ({"parity": "X"}, "Not a valid parity: 'X'"),
        ({"timeout": -1}, "Not a valid timeout: -1"),
        ({"colour": 1}, "unexpected keyword arguments"),
    ],
)
def test_wrong_settings_are_refused_as_pyserial_does(options: dict[str, Any], error: str) -> None:
    bench = OpenLine()
    bench.port.close()
    with pytest.raises(ValueError, match=error):
        SimSerial(bench.side, **options)
    SimSerial(bench.side)


def test_an_action_of_the_rig_is_never_stepped_past() -> None:
    bench, done = OpenLine(timeout=0.01), list[tuple[int, int]]()
    for t_us in (1, 999, 1_000, 5_000, 9_999, 10_000, 10_001, 20_000):
        bench.rig.event_queue.put(t_us, t_us, lambda at_us: done.append((at_us, bench.rig.now_us)))
    bench.port.read()
    assert [t_us for t_us, _ in done] == [1, 999, 1_000, 5_000, 9_999, 10_000]
    assert all(now_us == t_us - 1 for t_us, now_us in done)
    bench.port.write(bytes(100))
    bench.port.flush()
    assert [t_us for t_us, _ in done][6:] == [10_001, 20_000]


def test_a_fork_of_the_rig_has_a_port_of_its_own() -> None:
    port = echo(timeout=0.01)
    port.write(b"one\n")
    rig, twin = rig_of(port).fork(port)
    assert (twin.readline(), rig_of(twin)) == (b"one\n", rig)
    assert (rig_of(port).now_us, port.out_waiting) == (0, 4)
    assert port.readline() == b"one\n"
    for other in (copy.deepcopy(port), pickle.loads(pickle.dumps(port))):
        assert isinstance(other, SimSerial)
        other.write(b"two\n")
        assert other.readline() == b"two\n"
        assert rig_of(other) is not rig_of(port)
    assert port.in_waiting == 0


steps = st.lists(
    st.one_of(
        st.tuples(st.just("write"), st.binary(max_size=300)),
        st.tuples(st.just("read"), st.integers(0, 400)),
        st.tuples(st.just("run"), st.integers(0, 20_000)),
        st.tuples(st.just("flush"), st.none()),
        st.tuples(st.just("line"), st.none()),
        st.tuples(st.just("wait"), st.sampled_from([0, 0.0005, 0.01, 0.3])),
    ),
    max_size=30,
)


def play(port: SimSerial, steps: list[tuple[str, Any]]) -> list[object]:
    """Do what a host may do; return all that it sees, with the time."""
    rig, seen = rig_of(port), list[object]()
    for verb, what in steps:
        match verb:
            case "write":
                seen.append(port.write(what))
            case "read":
                seen.append(port.read(what))
            case "run":
                rig.run_for(what)
            case "flush":
                port.flush()
            case "line":
                seen.append(port.readline())
            case _:
                port.timeout = what
        seen.append((rig.now_us, port.in_waiting, port.out_waiting))
    return seen


@given(steps)
def test_the_same_calls_give_the_same_bytes_at_the_same_times(steps: list[tuple[str, Any]]) -> None:
    assert play(echo(timeout=0.1), steps) == play(echo(timeout=0.1), steps)


@given(steps, steps)
def test_a_twin_goes_on_as_the_original(
    first: list[tuple[str, Any]], then: list[tuple[str, Any]]
) -> None:
    port = echo(timeout=0.1)
    play(port, first)
    assert play(copy.deepcopy(port), then) == play(port, then)
