"""The tab of the alarms: rules that are held against the traffic while it goes on."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static, TextArea

from tickrig.host.canmon.extensions import load_rule
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.settings import below
from tickrig.host.canmon.tui.tasks.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import SettingError
from tickrig.host.monitor.check.alarms import RULE, Alarms, State, render_alarms
from tickrig.host.monitor.check.rules import SWITCHES, VALUES, Rules, parse_rules
from tickrig.host.tui.line_view import Line, LineView, plain
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

LOOK_US: Final = 100_000
"""How often it is seen whether something is missing."""


class AlarmTask(Task):
    """Takes frames, and looks for what is missing; it sends nothing.

    Args:
        model: tells the time of the source, and what was lost.

    Attributes:
        alarms: how the rules stand.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self.alarms = Alarms(Rules(), self.bit_rate, model.top.rates.fast)
        self._due_us = NEVER

    @property
    def bit_rate(self) -> int | None:
        """Of the buses, None if it is not known."""
        return self._model.top.view.bit_rate

    @property
    def due_us(self) -> int:
        """When it next wants to be called without a frame."""
        return self._due_us

    def hold(self, rules: Rules) -> None:
        """Hold other rules from now on; ValueError for a limit of the load without a bit rate."""
        self.alarms = Alarms(rules, self.bit_rate, self._model.top.rates.fast)
        self._due_us = NEVER if rules == Rules() else 0

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Take what was heard."""
        if self._due_us == NEVER:
            return ()
        for one in records:
            self.alarms.take(*one)
        if now_us >= self._due_us:
            self._due_us = now_us + LOOK_US
            self.alarms.check_missing(self._model.now_us, self._model.lost)
        return ()


STYLES: Final = {State.BROKEN: "bold red", State.WAS_BROKEN: "yellow"}


class AlarmsPanel(Panel):
    """Rules and findings."""

    title = "alarms"
    section = "alarms"
    HELP = """
    # Alarms

    The rules of `canmon check`, held against what is heard. A rule is BROKEN while something is
    missing, and for 2 s after a frame broke it; then it was broken, until somebody acknowledges.
    What has never come is missed after 2 s. Findings are below, the latest first.

    Rules are written as TOML, as for `canmon check`; F5 takes them, Escape leaves them:

        no_emcy = true
        no_sdo_abort = true
        max_load = 60
        nodes = [3, "16-18"]
        heartbeat = {3 = "100ms±20%"}
        max_gap = {181 = "20ms"}
        known = ["080", "181-18F"]
        rule = ["node 3 operational within 2s", "3.statusword.fault never"]
    """
    DEFAULT_CSS = """
    AlarmsPanel TextArea { display: none; height: 12; }
    AlarmsPanel #wrong { display: none; height: auto; color: $error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
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
        self.rules_text = ""
        self._lines: list[str] = []

    def compose(self) -> ComposeResult:
        """Lay out rules and findings."""
        yield LineView()
        yield Static(id="wrong", markup=False)
        yield TextArea(tab_behavior="focus")

    def snapshot(self, model: Model) -> None:
        """Keep how the rules stand."""
        self._lines = render_alarms(self.held.alarms, model.now_us)

    def paint(self) -> None:
        """Show it."""
        lines = [_styled(line) for line in self._lines]
        if not self.held.alarms.rows():
            lines = [plain("no rules: e writes some, F1 shows how")]
        self.query_one(LineView).show(lines)

    def load(self, settings: Mapping[str, Any]) -> None:
        """Take the rules."""
        words = settings.get("rules", {})
        if not isinstance(words, Mapping):
            raise SettingError(("rules",), "is no table of rules")
        with below("rules"):
            self.held.hold(parse_rules(words, load_rule))
        self.rules_text = rules_toml(words)

    def save(self) -> dict[str, Any]:
        """Return them; those that do not hold are None, so that a workspace leaves them out."""
        rules = dict.fromkeys((*SWITCHES, *VALUES))
        return {"rules": {**rules, **tomllib.loads(self.rules_text)}}

    def action_acknowledge(self) -> None:
        """Take note of all that was broken."""
        self.change(self.held.alarms.acknowledge)

    def action_clear(self) -> None:
        """Begin anew."""
        self.change(self.held.alarms.clear)

    def action_edit(self) -> None:
        """Write rules."""
        area = self.query_one(TextArea)
        area.text, area.display = self.rules_text, True
        area.focus()

    def action_apply(self) -> None:
        """Hold the rules that are written; say what is wrong with them."""
        area, wrong = self.query_one(TextArea), self.query_one("#wrong", Static)
        if not area.display:
            return
        try:
            rules = parse_rules(tomllib.loads(area.text), load_rule)
            with self.session.lock:
                self.held.hold(rules)
        except ValueError as error:
            wrong.update(str(error))
            wrong.display = True
            return
        self.rules_text = area.text
        self.action_leave()

    def action_leave(self) -> None:
        """Go back to the alarms."""
        self.query_one(TextArea).display = self.query_one("#wrong").display = False
        self.query_one(LineView).focus()
        self.refresh_view()


def rules_toml(words: Mapping[str, Any]) -> str:
    """Write rules as a person would."""
    import tomlkit  # noqa: PLC0415 - an extra

    return tomlkit.dumps(words)


def _styled(line: str) -> Line:
    if line.startswith((f"{RULE} ", "FINDINGS")):
        return plain(line, "bold")
    found = next((style for state, style in STYLES.items() if f" {state} " in line), "")
    return plain(line, found)
