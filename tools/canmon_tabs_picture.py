"""Draw each tab of the monitor and its settings at three sizes: SVG files of one virtual run.

`python tools/canmon_tabs_picture.py docs/pictures` draws them all, and
`python tools/canmon_tabs_picture.py docs/pictures nodes-80x24` some of them.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Collection, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Final

from rich.style import Style
from textual.strip import Strip

from tickrig.emulators.bench.operator import Operator
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import Described, describe_device, make_bench, make_nodes
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.frames import AnyRecord, Record
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.panel import make_panels
from tickrig.host.canmon.tui.session import Model, Session
from tickrig.host.canmon.workspace import MonitorSetup, PanelSettings, Workspace
from tickrig.host.cli.can_options import BusOptions
from tickrig.wire.can import CanFrame

SIZES: Final = ((80, 24), (120, 40), (200, 60))
BUS: Final = "can0"
BIT_RATE: Final = 500_000
FILES: Final = Path(__file__).parents[1] / "examples/eds"
MODELS: Final = {5: "epos", 6: "epos", 16: "f-palette", 32: "motor-core-unit"}
DESCRIBED: Final = (5, 6, 16)
"""Of node 32 nobody has an EDS."""

RUN: Final = """
0.05 605#2317100064000000 606#2B17100064000000 610#2B171000C8000000 620#2B171000F4010000
0.10 605#4008100000000000 605#4018100100000000 610#4018100100000000 620#4018100100000000
0.15 620#4008100000000000 605#2F60600003000000 605#2B17100064000000 620#4000100000000000
0.20 000#0105 000#0110 000#0120 620#2F00200005000000
0.30 205#0600
0.35 205#060000000000
0.40 205#070000000000
0.50 205#0F003C000000
0.60 6/power_off=1
0.70 16/emergency=8130
0.80 220#010203
0.90 605#2F01650001000000
1.00 080# 32/power_off=1
1.10 080# 32/power_off=0
1.20 205#0F0078000000
1.50 080# 605#4041600000000000
1.80 205#0F000A000000
2.50 080#
2.97 080#
"""
"""When, in seconds, what a master sends or what the world does to a node."""

SETTINGS: Final = {
    "objects": {"node": 5},
    "graph": {"window": "3s", "signals": ["5.position_actual_value", "5.target_velocity"]},
    "transmit": {
        "row": [
            {"send": "080#", "every": "10ms", "name": "SYNC"},
            {"send": "5.rpdo1 controlword=15 target_velocity=100", "name": "turn"},
            {"send": "100#0000", "every": "20ms", "counter": ["0:0..14"], "checksum": ["1:crc8"]},
        ]
    },
}


class RunSource(AnySource[AnyRecord]):
    """The wire of a bench, and what its master sent; its time passes while it is polled."""

    live = False  # what is shown has the time of the frames, not that of this machine

    def __init__(self, host: CanHost) -> None:
        self._host = host
        self.sent: list[AnyRecord] = []

    def send(self, frame: CanFrame) -> None:
        """Send a frame, and hear it."""
        self._host.send((frame,))
        self.sent.append(Record(self._host.now_us, BUS, frame))

    def poll(self, timeout_us: int, /) -> list[AnyRecord]:
        """Let time pass until a frame comes."""
        sent, self.sent = self.sent, []
        frames = self._host.receive(max(1, timeout_us))
        return [*sent, *(Record(self._host.now_us, BUS, frame) for frame in frames)]


def run() -> MonitorApp:
    """Return the monitor when it has heard all of `RUN`."""
    wire = CanWire()
    nodes = [Described(str(node), node, describe_device(name)) for node, name in MODELS.items()]
    bench = make_bench(wire, make_nodes(nodes, wire))
    host = CanHost(bench.rig, wire.end())
    source = RunSource(host)
    eds = {node: read_eds_objects(FILES / f"{MODELS[node]}.eds", node) for node in DESCRIBED}
    model = Model(eds, bit_rate=BIT_RATE)
    session = Session(source, model, {BUS: source.send}, lambda: host.now_us)
    panels = make_panels(session, print)
    for panel in panels:
        panel.load(SETTINGS.get(panel.section, {}))
    for line in RUN.strip().splitlines():
        at_s, *events = line.split()
        while session.now_us < float(at_s) * 1e6:
            session.step(round(float(at_s) * 1e6) - session.now_us)
        for event in events:
            _happen(event, source, bench.operator)
    session.step(1_000)
    setup = MonitorSetup(
        source=(BUS,),
        options=BusOptions(bitrate=BIT_RATE),
        eds={node: Path(f"eds/{MODELS[node]}.eds") for node in DESCRIBED},
        eds_dir=(Path("eds"),),
    )
    return MonitorApp(session, panels, PanelSettings(Workspace(), setup, panels))


def _happen(event: str, source: RunSource, operator: Operator) -> None:
    name, is_input, value = event.partition("=")
    if is_input:
        operator.set(name, int(value, 16))
    else:
        source.send(CanFrame.parse(event))


async def pictures(wanted: Collection[str] = ()) -> dict[str, str]:
    """Return the SVG of each tab and size, by names like `nodes-80x24`; all if none is wanted."""
    monitor, drawn = run(), {}
    async with monitor.run_test(size=SIZES[0]) as pilot:
        for width, height in SIZES:
            if wanted and not any(name.endswith(f"-{width}x{height}") for name in wanted):
                continue
            await pilot.resize_terminal(width, height)
            for number, panel in enumerate(monitor.panels, 1):
                name = f"{panel.title}-{width}x{height}"
                if not wanted or name in wanted:
                    await pilot.press(str(number))
                    drawn[name] = await _draw(monitor, pilot)
            name = f"settings-{width}x{height}"
            if not wanted or name in wanted:
                await pilot.press("f2")
                drawn[name] = await _draw(monitor, pilot)
                await pilot.press("escape")
    return drawn


STILL: Final = 12
"""After so many pictures the frames of the run are past: the rate is 0."""


async def _draw(monitor: MonitorApp, pilot: object) -> str:
    for badge in monitor.query("AlarmsPanel"):
        badge.refresh_badge()
    for _ in range(3):  # a size that has come needs another picture
        monitor.refresh_view()
        await pilot.pause()
    for _ in range(STILL):
        monitor.refresh_view()
    await pilot.pause()
    return svg(monitor.screen._compositor.render_strips())


CELL: Final = (8, 17)
GROUND, INK = "#121212", "#e0e0e0"


def svg(strips: Sequence[Strip]) -> str:
    """Return lines of a screen as SVG: a rectangle for each ground, a text for each run."""
    wide, high = CELL
    width, height = max(strip.cell_length for strip in strips) * wide, len(strips) * high
    parts = [part for row, strip in enumerate(strips) for part in _line(strip, row)]
    style = "text{font:13.3px monospace}.b{font-weight:bold}.d{opacity:.6}"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" fill="{INK}">'
    ground = f'<rect width="100%" height="100%" fill="{GROUND}"/>'
    return "\n".join([head, f"<style>{style}</style>", ground, *parts, "</svg>", ""])


def _line(strip: Strip, row: int) -> Iterator[str]:
    (wide, high), column = CELL, 0
    for segment in strip.simplify():
        text, cells = segment.text, segment.cell_length
        ink, ground, kind = _look(segment.style or Style())
        x, y = column * wide, row * high
        if ground != GROUND:
            yield f'<rect x="{x}" y="{y}" width="{cells * wide}" height="{high}" fill="{ground}"/>'
        if text.strip():
            begin = len(text) - len(text.lstrip())
            at = f'x="{x + begin * wide}" y="{y + 13}" textLength="{len(text.strip()) * wide}"'
            look = f' fill="{ink}"' * (ink != INK) + f' class="{kind}"' * bool(kind)
            words = escape(text.strip(), quote=False).replace(" ", "\N{NO-BREAK SPACE}")
            yield f"<text {at}{look}>{words}</text>"
        column += cells


def _look(style: Style) -> tuple[str, str, str]:
    """Return colour, ground, and the class of bold or dim text."""
    ink = style.color.get_truecolor().hex if style.color else INK
    ground = style.bgcolor.get_truecolor(foreground=False).hex if style.bgcolor else GROUND
    if style.reverse:
        ink, ground = ground, ink
    return ink, ground, "b" if style.bold else "d" if style.dim else ""


if __name__ == "__main__":
    for picture, text in asyncio.run(pictures(sys.argv[2:])).items():
        tab, _, size = picture.partition("-")
        folder = Path(sys.argv[1], size)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"canmon-{tab}.svg").write_text(text, "utf-8")
