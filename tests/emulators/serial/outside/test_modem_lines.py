from __future__ import annotations

import copy

import pytest
import serial

from tests.emulators.serial.outside.lines import OpenLine


def test_the_lines_of_a_device_without_them_are_off_as_those_of_an_open_adapter() -> None:
    port = OpenLine().port
    assert (port.cts, port.dsr, port.ri, port.cd) == (False, False, False, False)


def test_a_host_reads_what_the_lines_are_set_to() -> None:
    bench = OpenLine()
    lines = bench.side.modem_lines
    lines.cts = lines.cd = True
    assert (bench.port.cts, bench.port.dsr, bench.port.ri, bench.port.cd) == (1, 0, 0, 1)
    lines.dsr = lines.ri = True
    assert (bench.port.dsr, bench.port.ri) == (True, True)


def test_dtr_and_rts_are_on_while_the_port_is_open() -> None:
    bench = OpenLine()
    lines = bench.side.modem_lines
    assert (lines.dtr, lines.rts) == (True, True)
    bench.port.dtr = False
    assert (lines.dtr, lines.rts, bench.port.dtr) == (False, True, False)
    bench.port.rts = False
    assert (lines.dtr, lines.rts) == (False, False)
    bench.port.dtr = True
    bench.port.close()
    assert (lines.dtr, lines.rts) == (False, False)
    bench.port.open()
    assert (lines.dtr, lines.rts) == (True, False)


def test_dtr_may_be_set_before_the_port_is_opened() -> None:
    bench = OpenLine()
    bench.port.close()
    bench.port.dtr = False
    bench.port.open()
    assert not bench.side.modem_lines.dtr


def test_with_rtscts_nothing_is_sent_before_cts_is_on() -> None:
    bench = OpenLine(rtscts=True, write_timeout=0.01)
    assert bench.port.write(b"hello") == 5
    bench.rig.run_for(10_000)
    assert (bench.heard(), bench.port.out_waiting) == (b"", 5)
    bench.side.modem_lines.cts = True
    bench.rig.run_for(500)
    assert (bench.heard(), bench.port.out_waiting) == (b"hello", 0)
    bench.side.modem_lines.cts = False
    assert bench.port.write(bytes(4_096)) == 4_096
    with pytest.raises(serial.SerialTimeoutException):
        bench.port.write(b"x")
    bench.port.reset_output_buffer()
    assert bench.port.out_waiting == 0


def test_flush_waits_for_cts() -> None:
    bench = OpenLine(rtscts=True)
    bench.port.write(b"hello")

    def go(now_us: int) -> None:
        bench.side.modem_lines.cts = True

    bench.rig.event_queue.put("cts", 5_000, go)
    bench.port.flush()
    assert (bench.rig.now_us, bench.heard()) == (5_499, b"hello")
    bench.side.modem_lines.cts = False
    bench.port.write(b"x")
    with pytest.raises(serial.SerialException, match="nothing came for an hour"):
        bench.port.flush()


def test_without_rtscts_what_waited_is_sent() -> None:
    bench = OpenLine(rtscts=True)
    bench.port.write(b"hello")
    bench.port.rtscts = False
    bench.port.flush()
    assert bench.heard() == b"hello"


def test_a_twin_waits_for_the_cts_of_its_own_lines() -> None:
    bench = OpenLine(rtscts=True)
    bench.port.write(b"hello")
    twin = copy.deepcopy(bench.port)
    assert twin.side is not None
    twin.side.modem_lines.cts = True
    assert (twin.out_waiting, twin.cts) == (5, True)
    twin.flush()
    assert (twin.side.rig.now_us, bench.rig.now_us, bench.port.cts) == (500, 0, False)
    assert bench.port.out_waiting == 5
