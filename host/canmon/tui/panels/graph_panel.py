"""The tab of the graph, with curves of signals from a bus or a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, ClassVar, Final

import click
from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from tickrig.host.canmon.model.frames import Record, Stamp, stamp_text
from tickrig.host.canmon.model.graph.plot import LABEL_WIDTH, LiveGraph, ViewMode
from tickrig.host.canmon.model.graph.series import LEAST_US, CurveSpec, parse_signal
from tickrig.host.canmon.output.graph_file import check_graph_path, write_graph
from tickrig.host.canmon.tui.panels import panel
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import below, text_of, texts_of
from tickrig.host.text.values import parse_time_with_unit_us
from tickrig.host.tui import Line
from tickrig.wire.can import Frames

_COLOURS: Final = {
    "31": "red",
    "32": "green",
    "33": "yellow",
    "34": "blue",
    "35": "magenta",
    "36": "cyan",
}


class GraphTask(Task):
    """Task that collects the values of the displayed signals from the frames. It sends nothing.

    Args:
        graph: graph that receives the values.
    """

    def __init__(self, graph: LiveGraph) -> None:
        self._graph = graph

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Process records."""
        if self._graph.words:
            for one, decoded in records:
                self._graph.take(one, decoded)
        return ()


_PICTURE: Final = (960, 400)
_QUESTION: Final = "[LABEL=]SIGNAL[@AXIS], as 5.velocity, 5.statusword.fault, 181[2:6]s*0.001@2"
_EMPTY: Final = "no signals: a adds one, F1 shows how"


class GraphPanel(panel.Panel):
    """Curves with a cursor, several axes, and zoom in both directions."""

    title = "graph"
    section = "graph"
    HELP = panel.read_help(__file__)
    DEFAULT_CSS = "GraphPanel #state { background: $boost; }"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "add", "add"),
        Binding("x", "remove", "remove"),
        Binding("plus,equals_sign", "graph('zoom', 2)", "zoom", key_display="+ -"),
        Binding("minus", "graph('zoom', 0.5)", "zoom out", show=False),
        Binding("left", "graph('move_cursor', -0.01)", "cursor", key_display="← →"),
        Binding("right", "graph('move_cursor', 0.01)", "cursor right", show=False),
        Binding("shift+left", "graph('move_cursor', -0.1)", "cursor far left", show=False),
        Binding("shift+right", "graph('move_cursor', 0.1)", "cursor far right", show=False),
        Binding("comma", "graph('move', -0.25)", "move", key_display=", ."),
        Binding("full_stop", "graph('move', 0.25)", "move on", show=False),
        Binding("l", "graph('show', 'live')", "live"),
        Binding("h", "graph('show', 'all')", "all"),
        Binding("space", "graph('show', 'held')", "hold"),
        Binding("y", "graph('next_axis')", "axis"),
        Binding("up", "graph('lift', 0.1)", "axis up", show=False),
        Binding("down", "graph('lift', -0.1)", "axis down", show=False),
        Binding("i", "graph('stretch', 2)", "axis closer", show=False),
        Binding("o", "graph('stretch', 0.5)", "axis farther", show=False),
        Binding("r", "graph('fit')", "fit axis", show=False),
        Binding("c", "graph('clear')", "clear"),
        Binding("s", "write", "write a file"),
    ]

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.graph = LiveGraph(ViewMode.LIVE if session.source.live else ViewMode.ALL)
        session.tasks.append(GraphTask(self.graph))
        self._texts: list[str] = []
        self._lines: list[Line] = []

    def compose(self) -> ComposeResult:
        """Lay out state and picture."""
        yield panel.TitleLine("state")
        yield panel.PictureView()
        yield panel.PromptLine()

    def snapshot(self, model: Model) -> None:
        """Draw the picture, which reads the samples."""
        self.graph.now_us = model.now_us
        self.graph.first_us, self.graph.stamp = self.session.origin_us, self.session.stamp
        width, height = self.query_one(panel.PictureView).size
        if self.graph.words:
            self._lines = [
                panel.ansi_line(line, _COLOURS) for line in self.graph.render(width, height)
            ]
        else:
            self._lines = [((_EMPTY, ""),)]

    def paint(self) -> None:
        """Show the picture."""
        self.query_one("#state", panel.TitleLine).show(self._state())
        self.query_one(panel.PictureView).show(self._lines)

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load signals and window."""
        for number, text in enumerate(texts_of(settings, "signals")):
            with below("signals", number):
                self._add_signal(text)
        window = text_of(settings, "window", "10s")
        with below("window"):
            self.graph.window_us = max(LEAST_US, parse_time_with_unit_us(window))

    def save(self) -> dict[str, Any]:
        """Return signals and window."""
        return {"signals": list(self._texts), "window": _time_text(self.graph.window_us)}

    def action_add(self) -> None:
        """Ask for a signal."""
        self.query_one(panel.PromptLine).prompt(_QUESTION, "", self._add)

    def action_remove(self) -> None:
        """Ask which signal to remove."""
        if self._texts:
            self.query_one(panel.PromptLine).prompt("take out", self._texts[-1], self._remove)

    def action_graph(self, change: str, *arguments: Any) -> None:
        """Call a method of the graph that changes the view, such as `zoom`, `move` or `fit`."""
        self.change(lambda: getattr(self.graph, change)(*arguments))

    def action_write(self) -> None:
        """Ask for a file, and write the picture or the samples to it."""
        self.query_one(panel.PromptLine).prompt(
            "file: .svg .html .png .csv", "graph.svg", self._write
        )

    def on_picture_view_pointed(self, event: panel.PictureView.Pointed) -> None:
        """Put the cursor at the position of the mouse."""
        with self.session.lock:
            view = self.graph.view()
            inner = max(1, self.query_one(panel.PictureView).size.width - LABEL_WIDTH - 1)
            share = min(max(0.0, (event.x - LABEL_WIDTH - 1) / inner), 1.0)
            self.graph.cursor_us = view.from_us + round(view.span_us * share)
            self.graph.move_cursor(0)
        self.refresh_view()

    def _add(self, text: str) -> None:
        self._add_signal(text)
        self.refresh_view()

    def _add_signal(self, text: str) -> None:
        word: CurveSpec = parse_signal(text)
        with self.session.lock:
            trace = self.session.model.trace
            rows = trace.rows(trace.first, trace.count)
            pairs = ((row.record, row.decoded) for row in rows)
            self.graph.add(word, ((one, seen) for one, seen in pairs if isinstance(one, Record)))
        self._texts.append(text)

    def _remove(self, text: str) -> None:
        if text not in self._texts:
            raise ValueError(f"{text!r} is not one of {', '.join(self._texts)}")
        number = self._texts.index(text)
        with self.session.lock:
            self.graph.remove(number)
        del self._texts[number]
        self.refresh_view()

    def _write(self, text: str) -> None:
        path = Path(text)
        try:
            check_graph_path(path)
            with self.session.lock:
                series, view = deepcopy(self.graph.series), self.graph.view()
            write_graph(path, series, view, _PICTURE)
        except click.ClickException as error:
            raise ValueError(error.message) from None
        self.notify(f"{path} is written", markup=False)

    def _state(self) -> str:
        graph = self.graph
        words = [str(graph.mode), f"window {graph.window_us / 1e6:g} s", f"axis {graph.axis}"]
        if graph.cursor_us is not None:
            origin_us = graph.view().origin_us
            time = stamp_text(graph.stamp, graph.cursor_us, origin_us, origin_us)
            words.append(f"cursor at {time}{' s' * (graph.stamp is not Stamp.DATE)}")
        return "   ".join(words)


def _time_text(time_us: int) -> str:
    """Return a time as text that can be read again.

    >>> _time_text(10_000_000), _time_text(1_500), _time_text(2_000)
    ('10s', '1500us', '2ms')
    """
    for unit, size_us in (("s", 1_000_000), ("ms", 1_000)):
        if time_us % size_us == 0:
            return f"{time_us // size_us}{unit}"
    return f"{time_us}us"
