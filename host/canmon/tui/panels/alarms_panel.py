"""The alarms tab, with rules that are checked against the traffic as it arrives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static, TabbedContent, TextArea

from tickrig.host.canmon.extensions import load_rule
from tickrig.host.canmon.model.check.checker import RULE, Alarms, AlarmState, render_alarms
from tickrig.host.canmon.model.check.rule import TrafficFinding
from tickrig.host.canmon.model.check.rules import SWITCHES, VALUES, Rules, parse_rules
from tickrig.host.canmon.model.frames import stamp_text
from tickrig.host.canmon.tui.panels.panel import ChoiceView, FrameWanted, Panel, read_help
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import SettingError, below
from tickrig.host.text.toml_reader import load_toml
from tickrig.host.tui import Line, LineView, plain
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

_LOOK_US: Final = 100_000
"""Interval of checks for missing frames."""


class AlarmTask(Task):
    """Task that checks all frames with the rules of the alarms, and detects missing frames.

    The task sends nothing.

    Args:
        model: model of the session, with the time of the source and the number of lost frames.

    Attributes:
        alarms: evaluation of the rules, with the state of each rule.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self.alarms = Alarms(Rules(), self.bit_rate, model.top.rates.fast)
        self._due_us = NEVER

    @property
    def bit_rate(self) -> int | None:
        """Bit rate of the buses, or None if it is unknown."""
        return self._model.top.view.bit_rate

    @property
    def due_us(self) -> int:
        """Time at which the next call is due, even if no frame arrives."""
        return self._due_us

    def hold(self, rules: Rules) -> None:
        """Replace the rules that frames are checked with, and restart the check.

        Raises:
            ValueError: a rule limits the load, but the bit rate of the bus is unknown.
        """
        self.alarms = Alarms(rules, self.bit_rate, self._model.top.rates.fast)
        self._due_us = NEVER if rules == Rules() else 0

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Process records."""
        if self._due_us == NEVER:
            return ()
        for one in records:
            self.alarms.take(*one)
        if now_us >= self._due_us:
            self._due_us = now_us + _LOOK_US
            self.alarms.check_missing(self._model.now_us, self._model.lost)
        return ()


_USUAL: Final = dict.fromkeys(("no_emcy", "no_error_frames", "no_lost_heartbeat", "no_loss"), True)
"""Default rules. Bus-off is also an error frame."""
_USUAL_LOAD: Final = {"max_load": 90}
"""Default limit of the load, used if the bit rate is known."""
LEAST_WIDTH, INDENT = 40, 4
_BADGE_S: Final = 0.5
_BADGES: Final = {AlarmState.BROKEN: ("!", "bold red"), AlarmState.WAS_BROKEN: ("!", "yellow")}


class AlarmsPanel(Panel):
    """A list of rules and findings."""

    title = "alarms"
    section = "alarms"
    HELP = read_help(__file__)
    DEFAULT_CSS = """
    AlarmsPanel TextArea { display: none; height: 12; }
    AlarmsPanel #wrong { display: none; height: auto; color: $error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "frame", "frame in the trace", key_display="enter"),
        Binding("space", "acknowledge", "acknowledge"),
        Binding("c", "clear", "clear"),
        Binding("e", "edit", "rules"),
        Binding("f5", "apply", "take the rules", key_display="F5"),
        Binding("escape", "leave", "leave the rules", show=False),
    ]

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.held = AlarmTask(session.model)
        session.tasks.append(self.held)
        words = {**_USUAL, **(_USUAL_LOAD if self.held.bit_rate else {})}
        self.held.hold(parse_rules(words))
        self.rules_text, self._own = _rules_toml(words), False
        self._lines: list[str] = []
        self._targets: list[TrafficFinding | None] = []
        self._chosen: TrafficFinding | None = None
        self._badge = ""

    def compose(self) -> ComposeResult:
        """Lay out rules and findings."""
        yield ChoiceView()
        yield Static(id="wrong", markup=False)
        yield TextArea(tab_behavior="focus")

    def on_mount(self) -> None:
        """Keep the title of the tab up to date, whichever tab is shown."""
        self.set_interval(_BADGE_S, self.refresh_badge)

    def refresh_badge(self) -> None:
        """Mark the title of the tab if a rule is broken, until the user acknowledges the alarm."""
        now_us = self.session.model.now_us
        with self.session.lock:
            states = {alarm.state(now_us) for alarm in self.held.alarms.rows()}
        mark, style = next((_BADGES[state] for state in _BADGES if state in states), ("", ""))
        tab = self.screen.query_one(TabbedContent).get_tab(f"tab-{self.section}")
        title = tab.label_text.removesuffix("!") + mark
        if tab.label_text != title or style != self._badge:
            self._badge = style
            tab.label = Content.styled(title, style)

    def snapshot(self, model: Model) -> None:
        """Copy the state of the rules, and the finding of each line."""
        alarms = self.held.alarms
        rules = render_alarms(alarms, model.now_us)[: -len(alarms.findings) or None]
        self._lines, self._targets = rules, [None, *(one.finding for one in alarms.rows())]
        self._targets += [None] * (len(rules) - len(self._targets))
        width = max(LEAST_WIDTH, self.query_one(LineView).scrollable_content_region.width)
        before = [self.session.origin_us, *(one.at_us for one in alarms.findings)]
        pairs = list(zip(alarms.findings, before, strict=False))
        for finding, before_us in reversed(pairs):
            parts = _wrapped(self._finding(finding, before_us), width)
            self._lines += parts
            self._targets += [finding] * len(parts)

    def _finding(self, finding: TrafficFinding, before_us: int) -> str:
        """Return a finding as text, with its time in the format of the other tabs."""
        session, (_, _, text) = self.session, str(finding).partition(") ")
        time = stamp_text(session.stamp, finding.at_us, session.origin_us, before_us)
        return f"({time}) {text}"

    def paint(self) -> None:
        """Show the snapshot."""
        lines = [_styled(line) for line in self._lines]
        if not self.held.alarms.rows():
            lines = [plain("no rules: e writes some, F1 shows how")]
        view = self.query_one(ChoiceView)
        chosen = self._chosen
        if chosen is not None and self._target(view.chosen) is not chosen:
            same = (number for number, one in enumerate(self._targets) if one is chosen)
            view.chosen = max(same, default=view.chosen)  # findings go down while others come
        view.show(lines)

    def on_choice_view_chosen(self) -> None:
        """Stay at the chosen finding while new findings appear above."""
        number = self.query_one(ChoiceView).chosen
        self._chosen = self._target(number) if number > len(self.held.alarms.rows()) else None

    def _target(self, number: int) -> TrafficFinding | None:
        return self._targets[number] if number < len(self._targets) else None

    def action_frame(self) -> None:
        """Show the frame of a finding in the trace tab.

        The finding is the chosen one, or the latest finding of the chosen rule.
        """
        finding = self._target(self.query_one(ChoiceView).chosen)
        if finding is None:
            self.notify("choose a finding: the arrows do")
        else:
            self.post_message(FrameWanted(finding.at_us, finding.record))

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load the rules."""
        if "rules" not in settings:
            return
        words = settings["rules"]
        if not isinstance(words, Mapping):
            raise SettingError(("rules",), "is no table of rules")
        with below("rules"):
            self.held.hold(parse_rules(words, load_rule))
        self.rules_text, self._own = _rules_toml(words), True

    def save(self) -> dict[str, Any]:
        """Return the rules of the user. None removes a rule from a workspace."""
        if not self._own:
            return {}
        rules = dict.fromkeys((*SWITCHES, *VALUES))
        return {"rules": {**rules, **load_toml(self.rules_text)}}

    def action_acknowledge(self) -> None:
        """Acknowledge all broken rules."""
        self.change(self.held.alarms.acknowledge)

    def action_clear(self) -> None:
        """Delete all findings and restart the rules."""
        self.change(self.held.alarms.clear)

    def action_edit(self) -> None:
        """Edit the rules."""
        area = self.query_one(TextArea)
        area.text, area.display = self.rules_text, True
        area.focus()

    def action_apply(self) -> None:
        """Apply the edited rules, or report an error in them."""
        area, wrong = self.query_one(TextArea), self.query_one("#wrong", Static)
        if not area.display:
            return
        try:
            self.take_rules(area.text)
        except ValueError as error:
            wrong.update(str(error))
            wrong.display = True
            return
        self.action_leave()

    def take_rules(self, text: str) -> None:
        """Apply rules that are written as TOML. Raise ValueError if they are invalid."""
        rules = parse_rules(load_toml(text), load_rule)
        with self.session.lock:
            self.held.hold(rules)
        self.rules_text, self._own = text, True

    def action_leave(self) -> None:
        """Return to the alarms."""
        self.query_one(TextArea).display = self.query_one("#wrong").display = False
        self.query_one(LineView).focus()
        self.refresh_view()


def _wrapped(line: str, width: int) -> list[str]:
    """Split a line that is longer than the width of the screen."""
    if len(line) <= width:
        return [line]
    return wrap(line, width, subsequent_indent=" " * INDENT, break_on_hyphens=False)


def _rules_toml(words: Mapping[str, Any]) -> str:
    """Return rules as TOML in the style of a person."""
    import tomlkit  # noqa: PLC0415 - an extra

    return tomlkit.dumps(words)


def _styled(line: str) -> Line:
    if line.startswith((f"{RULE} ", "FINDINGS")):
        return plain(line, "bold")
    found = next((style for state, (_, style) in _BADGES.items() if f" {state} " in line), "")
    return plain(line, found)
