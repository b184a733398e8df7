"""Text of the operator panel, without terminal and clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from rich.text import Text

from tickrig.host.control.requests import Object
from tickrig.host.rrc.gauges import DIM, FAULT, ON, bar, lamp, scale
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import format_time
from tickrig.wire.errors import WireError
from tickrig.wire.rrc.message import SAFE_PCT
from tickrig.wire.rrc.replies import StatusA, parse_reply

_Value = int | str
_Values = dict[str, _Value]

FAULT_KEYS: Final = {
    "1": "bus_noise",
    "2": "joystick_fault",
    "3": "power_module_fault",
    "4": "vr2_fault",
    "5": "bus_unplugged",
    "6": "cut",
}
_BUTTONS: Final = {
    "power": "power_button",
    "alarm": "alarm_button",
    "speed up": "speed_up_button",
    "speed down": "speed_down_button",
}
_STATE_STYLES: Final = {
    "Limit": "bold black on green",
    "Output": "bold black on green",
    "Standby": "bold black on cyan",
    "PowerOffByOthers": "bold white on red",
}
_LINE_STYLES: Final = {"EV": "bold cyan", "ER": "bold red"}

_KEPT_LINES: Final = 60
_REPORT_US: Final = 100_000
"""Time for which the latest SA line is shown; a line arrives every 10 ms while the status is on."""


@dataclass(frozen=True, slots=True)
class PanelView:
    """State of the emulated RRC at one time, as the terminal panel shows it.

    Attributes:
        values: values of inputs and outputs by name.
        status: values by name that describe the run of the emulator, such as its time.
        lines: latest lines on the wire, each as `(time, mark, text)`. `SA` lines, the periodic
            reports of the RRC, are omitted.
        report: latest `SA` line, or empty if no `SA` lines arrive now.
    """

    values: Mapping[str, _Value] = field(default_factory=dict)
    status: Mapping[str, _Value] = field(default_factory=dict)
    lines: tuple[tuple[str, str, str], ...] = ()
    report: str = ""

    def number(self, name: str) -> int:
        """Return a numeric value, or 0 if it is not known yet."""
        value = self.values.get(name, 0)
        return value if isinstance(value, int) else 0

    @property
    def decoded(self) -> StatusA | None:
        """The decoded latest SA line, or None if there is none."""
        try:
            reply = parse_reply(self.report.encode())
        except WireError:
            return None
        return reply if isinstance(reply, StatusA) else None

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the active faults."""
        return tuple(str(self.status.get("faults", "")).split())


class _WireRow(NamedTuple):
    """A line on the wire."""

    number: int
    at_us: int
    mark: str
    text: str

    @property
    def is_report(self) -> bool:
        """Whether the line belongs to a stream of SA lines."""
        return self.mark == Mark.FROM_DEVICE and self.text.startswith("SA:")


class Observer:
    """Keeps the state for the terminal panel, from the emulator's answers to its requests.

    The requests are `get`, `status` and `lines`.

    Attributes:
        view: the present state.
        seen: number of the latest line on the wire. The next request asks for the lines after it.
    """

    def __init__(self) -> None:
        self.view, self.seen = PanelView(), 0
        self._report = _WireRow(0, -_REPORT_US, "", "")  # the latest SA

    def take(self, values: Object, status: Object, lines: Object) -> None:
        """Add three answers from the same time."""
        fresh = [line for line in _lines(lines) if line.number > self.seen]
        self.seen = fresh[-1].number if fresh else self.seen
        now, present = _values(status), _values(values["values"])
        for line in fresh:
            if line.is_report:
                self._report = line
        events = [(format_time(x.at_us), x.mark, x.text) for x in fresh if not x.is_report]
        self.view = PanelView(
            present,
            now,
            (*self.view.lines, *events)[-_KEPT_LINES:],
            self._report.text if self._reports(now, present) else "",
        )

    def _reports(self, status: _Values, values: _Values) -> bool:
        """Return whether SA lines arrive: VR2 runs, and the latest SA line is recent."""
        fresh = self._report.at_us + _REPORT_US > int(status["now_us"])
        return fresh and bool(values["vr2_power"])


def _values(answer: object) -> _Values:
    if not isinstance(answer, dict):
        return {}
    return {name: value for name, value in answer.items() if isinstance(value, int | str)}


def _lines(answer: Object) -> list[_WireRow]:
    lines = answer["lines"]
    if not isinstance(lines, list):
        return []
    return [_WireRow(x["number"], x["at_us"], x["mark"], x["text"]) for x in lines]


_STICK_HINTS: Final = {
    "Off": "the RRC has no power",
    "Standby": "waits for limit, or a",
    "Limit": "drives, within limits",
    "Output": "the host drives",
    "PowerOffByButton": "waits: VR2 goes off",
    "PowerOffByOthers": "waits for p: stopped",
}


def stick_hint(view: PanelView) -> str:
    """Return a hint for the panel: whether the stick drives the wheelchair, or why not.

    The hint has at most 21 columns.
    """
    state = str(view.values.get("state", ""))
    if state == "Standby" and view.number("stick_drives"):
        return "drives"
    return _STICK_HINTS.get(state, "waits for p: VR2 off")


def lamps(view: PanelView) -> list[Text]:
    """Draw the three lamps."""
    return [
        lamp("VR2 runs", view.number("vr2_power"), "bold green"),
        lamp("error LED", view.number("error_led"), "bold red"),
        lamp("buzzer", view.number("buzzer"), ON),
    ]


def load(view: PanelView) -> Text:
    """Show the load of the RRC, and the time that is left."""
    margin_pct = view.number("margin_pct")
    style = FAULT if margin_pct < 0 else ON if margin_pct < 100 - SAFE_PCT else ""
    return Text(f"{view.number('load_pct')} %, margin {margin_pct} %", style=style)


def state_of(view: PanelView) -> Text:
    """Show the state in its colour."""
    state = str(view.values.get("state", "?"))
    return Text(f" {state} ", _STATE_STYLES.get(state, "bold reverse"))


def outputs_pane(view: PanelView) -> Text:
    """Show the state and the outputs of the RRC."""
    rows = [
        Text.assemble("state  ", state_of(view)),
        Text.assemble("drive  v ", bar(view.number("out_v_pct"))),
        Text.assemble("       w ", bar(view.number("out_w_pct"))),
        Text.assemble(
            *("speed  ", scale(view.number("speed_mode"), 5)),
            *("   gear ", (str(view.values.get("gear", "?")), "bold")),
            *("   gauge ", scale(view.number("gauge"), 10)),
        ),
        Text.assemble("load   ", load(view), f"; at most {view.number('pace_lines_s')} lines/s"),
        Text.assemble("       ", Text("   ").join(lamps(view))),
    ]
    return Text("\n").join(rows)


def controls_pane(view: PanelView) -> Text:
    """Show the pressed buttons and the active faults."""
    rows = [Text(" ").join(faults(view, 22)[at : at + 2]) for at in range(0, len(FAULT_KEYS), 2)]
    return Text("\n").join([buttons(view), *rows])


def buttons(view: PanelView) -> Text:
    """Show the pressed buttons."""
    return Text(" ").join(
        Text(f" {label} ", style="bold black on yellow" if view.number(name) else "reverse dim")
        for label, name in _BUTTONS.items()
    )


def faults(view: PanelView, width: int) -> list[Text]:
    """Show each fault and its key, in a number of columns."""
    return [
        Text.assemble(
            (shown := f"{key} {name}", FAULT if name in view.faults else ""),
            " " * (width - len(shown)),
        )
        for key, name in FAULT_KEYS.items()
    ]


def report_line(view: PanelView) -> Text:
    """Show the values of the latest SA line, and its raw text."""
    if (sa := view.decoded) is None:
        return Text(view.report)
    return Text(
        f" stick {sa.in_v_pct:+} {sa.in_w_pct:+}  out {sa.out_v_pct:+} {sa.out_w_pct:+}"
        f"  gauge {sa.gauge}  speed {sa.speed_mode}"
        f"  up {sa.speed_up_count} down {sa.speed_down_count} alarm {sa.alarm_count}",
        style=DIM,
    )


def wire_pane(view: PanelView, height: int) -> Text:
    """Show the latest lines on the wire, the newest at the bottom."""
    rows = []
    for time, mark, text in view.lines[max(0, len(view.lines) - height) :]:
        style = "bold green" if mark == ">" else _LINE_STYLES.get(text[:2], "")
        rows.append(Text.assemble((f"{time:>11} ", DIM), (f"{mark} {text}", style)))
    return Text("\n").join(rows)


def status_line(view: PanelView) -> Text:
    """Show the status of the run."""
    status, now_us = view.status, view.status.get("now_us", 0)
    text = Text(f" {status.get('link', '')}   {int(now_us) / 1e6:.1f} s")
    late, lost = int(status.get("late_steps", 0)), int(status.get("lost_bytes", 0))
    text.append(f"   late ticks {late}", style=ON if late else "")
    text.append(f"   lost bytes {lost}", style=ON if lost else "")
    if setting := status.get("host_setting"):
        text.append(f"   host at {setting}", style=ON)
    if error := status.get("trace_error"):
        text.append(f"   trace ended: {error}", style="bold red")
    return text
