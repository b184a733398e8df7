"""What the tabs of `canmon tui` cost, what their pictures cost, and how late rows are sent."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.table import RUNS, percentiles, row
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, read_eds_objects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.plot import MOST, LiveGraph, ViewMode
from tickrig.host.canmon.model.graph.series import parse_signal
from tickrig.host.canmon.model.node_dictionary import NodeDictionary, render_dictionary
from tickrig.host.canmon.model.transmit import parse_row_text
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.tui.panels.panel import TABS, Panel
from tickrig.host.canmon.tui.panels.transmit_panel import TransmitTask
from tickrig.host.canmon.tui.session import Model, Session, open_session
from tickrig.host.cli.can_options import BusOptions
from tickrig.wire.can import CanFrame

EPOS = Path(__file__).parents[2] / "examples/eds/epos.eds"
FRAMES, BATCH = 40_000, 400
PERIOD_US = 10_000
SETTINGS = {
    "graph": {"signals": ["5.position", "5.velocity@2", "185[0]"]},
    "alarms": {
        "rules": {"no_emcy": True, "nodes": [5], "max_load": 60, "heartbeat": {"5": "100ms±20%"}}
    },
}

PANELS = tuple(map(TABS.load, TABS.built_in))


class Frames(AnySource[Record]):
    """PDOs of a drive, in batches."""

    live = True

    def __init__(self) -> None:
        self._batches = [_batch(at * BATCH) for at in range(FRAMES // BATCH)][::-1]

    def poll(self, timeout_us: int, /) -> list[Record]:
        """Return the next batch."""
        return self._batches.pop()


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    _sessions("no tab", (), {})
    _sessions("all tabs", PANELS, {})
    _sessions("all tabs, three curves, four rules", PANELS, SETTINGS)
    _pictures()
    _lateness(seconds)


def _sessions(what: str, panels: tuple[type[Panel], ...], settings: dict[str, object]) -> None:
    values = []
    for _ in range(RUNS):
        session = Session(Frames(), Model(_drive(), bit_rate=1_000_000))
        for panel in [panel(session) for panel in panels]:
            panel.load(settings.get(panel.section, {}))
        spent_s = _spent_s(lambda session=session: [session.step() for _ in range(FRAMES // BATCH)])
        values.append(FRAMES / spent_s)
    row(f"a session, {what}", values, "frames/s of processor")


def _pictures() -> None:
    objects = NodeDictionary(Decoder(_drive()).memory("can0", 5))
    count = len(objects.rows())
    paint = [_spent_s(lambda: render_dictionary(objects.rows(), 0)) * 1e3 for _ in range(RUNS)]
    row(f"objects: {count} rows", paint, "ms of processor")
    graph = LiveGraph(ViewMode.ALL)
    for word in ("185[0]", "185[2:6]s@2"):
        graph.add(parse_signal(word), ((record, None) for record in _batch(0, MOST)))
    paint = [_spent_s(lambda: graph.render(110, 24)) * 1e3 for _ in range(RUNS)]
    row(f"graph: 2 curves of {MOST:,} samples", paint, "ms of processor")


def _lateness(seconds: float) -> None:
    session = open_session(["virtual:tabs"], BusOptions(), Model())
    sent_us: list[int] = []
    name, put = next(iter(session.buses.items()))

    def recording(frame: CanFrame) -> None:
        sent_us.append(session.now_us)
        put(frame)

    session.buses[name] = recording
    task = TransmitTask({})
    task.add(parse_row_text("080# --every 10ms"))
    session.tasks.append(task)
    session.arm()
    start_us = session.now_us + 100_000
    task.enable(0, start_us, armed=True)
    session.start()
    time.sleep(seconds)
    session.close()
    session.source.close()
    late = [float((at_us - start_us) % PERIOD_US) for at_us in sent_us]
    percentiles(f"a row each 10 ms for {seconds:g} s: late", late, "us")


def _drive() -> dict[int, EdsObjects]:
    return {5: read_eds_objects(EPOS, 5)}


def _batch(first: int, count: int = BATCH) -> list[Record]:
    return [
        Record(at * 200, "can0", CanFrame(0x185 if at % 2 else 0x205, at.to_bytes(6, "little")))
        for at in range(first, first + count)
    ]


def _spent_s(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start
