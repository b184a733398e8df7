from __future__ import annotations

import os
import tty
from pathlib import Path

import pytest

from tests.host.canmon.wire import new_wire
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.frames import LineRecord, Record
from tickrig.host.canmon.model.trace import DisplayFilter
from tickrig.host.canmon.sources.line_source import RrcLines
from tickrig.host.canmon.tui.panels.graph_panel import GraphPanel
from tickrig.host.canmon.tui.panels.trace_panel import TraceLines
from tickrig.host.canmon.tui.session import Model, open_session
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.tui import line_text
from tickrig.wire.can import CanFrame

STEPS = 2_000
POLL_US = 5_000


def taken() -> Model:
    """A frame, a line from an RRC, and a line to it."""
    model, rrc = Model(), RrcLines("ttyS0")
    (event,) = rrc.take(1_100_000, b"EV:PowerOn\r\n", to_device=False)
    (command,) = rrc.take(1_200_000, b"output0000\n", to_device=True)
    assert model.take([Record(1_000_000, "can0", CanFrame.parse("705#05")), event, command])
    return model


def test_lines_stand_in_the_trace_of_the_frames() -> None:
    model = taken()
    refresh_view = TraceLines(origin_us=1_000_000, channel_width=5)
    assert [line_text(refresh_view.line(row)).strip() for row in model.trace.rows(0, 3)] == [
        "0.000000        - can0  705       [1] 05                      5 heartbeat operational",
        "0.100000        - ttyS0 <         EV:PowerOn                  rrc event PowerOn",
        "0.200000        - ttyS0 >         output0000                  rrc output v_pct=0 w_pct=0",
    ]
    assert (model.frames, model.now_us) == (1, 1_200_000)


def test_a_filter_passes_lines_and_each_direction_is_a_row_of_its_own() -> None:
    sieve = DisplayFilter(taken().trace, parse_filter("kind=rrc"))
    assert [(one.row.record.sent, one.frames) for one in sieve.latest()] == [(False, 1), (True, 1)]


def test_a_long_line_moves_what_it_means() -> None:
    (row,) = (Model().trace.take(line) for line in [_line(b"x" * 40)])
    assert line_text(TraceLines().line(row)).endswith("x" * 40)


def _line(data: bytes) -> LineRecord:
    (line,) = RrcLines("ttyS0").take(0, data + b"\r\n", to_device=False)
    return line


@pytest.mark.realtime
def test_a_port_and_a_bus_are_heard_together_and_the_bus_sends() -> None:
    far, near = os.openpty()
    tty.setraw(near)
    with new_wire() as wire:
        words = [wire.word, f"serial:{os.ttyname(near)},rrc"]
        session = open_session(words, BusOptions(), Model())
        panel = GraphPanel(session)
        for _ in range(STEPS):
            os.write(far, b"EV:PowerOn\r\n")  # opening a port drops what had come before
            wire.send("705#05")
            session.step(POLL_US)
            rows = session.model.trace.rows(0, session.model.trace.count)
            if {row.record.channel for row in rows} == {wire.name, Path(os.ttyname(near)).name}:
                break
        else:
            raise AssertionError(rows)
        panel.load({"signals": ["705[0]"]})
        assert set(panel.graph.series[0].values) == {5.0}
        assert list(session.buses) == [wire.name]
        session.close()
        session.source.close()
    os.close(near)
    os.close(far)


def test_a_port_that_is_not_there_closes_the_bus() -> None:
    with new_wire() as wire, pytest.raises(SourceFailed, match="/dev/nowhere"):
        open_session([wire.word, "serial:/dev/nowhere,rrc"], BusOptions(), Model())


def test_ports_and_logs_do_not_go_together() -> None:
    with pytest.raises(Refused, match="cannot be mixed"):
        open_session(["run.log", "serial:/dev/nowhere,rrc"], BusOptions(), Model())
