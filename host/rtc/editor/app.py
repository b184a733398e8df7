"""The System Editor of RT components, with picture, states, connectors and configuration sets."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container

from tickrig.host.cli.messages import Refused
from tickrig.host.control.requests import Object
from tickrig.host.rtc.commands.request import request_system
from tickrig.host.rtc.editor.styles import ALARM, DIM, LIT
from tickrig.host.rtc.editor.system_link import SystemLink
from tickrig.host.rtc.editor.system_picture import SystemPicture
from tickrig.host.rtc.editor.widgets import ChoiceScreen, CursorRow, CursorView, QuestionScreen
from tickrig.host.rtc.system.dot import boxes_and_edges
from tickrig.host.rtc.system.system_file import file_format
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import write_whole
from tickrig.host.tui import FramedApp, KeyFooter, Line, LineView, plain

PAINT_S: Final = 0.1

_GOOD: Final = "green"

_MOVES: Final = ("activate", "deactivate", "reset")


class _Setting(NamedTuple):
    """A row of the details.

    Attributes:
        set_id: ID of a configuration set, empty for the present parameter values.
        parameter: name of one parameter of the set, empty for the set itself.
        value: value of the parameter.
        peer: other end of a connector of the port under the cursor, empty for other rows.
    """

    set_id: str = ""
    parameter: str = ""
    value: str = ""
    peer: str = ""


def _detail_rows(component: Any, port: str = "") -> list[CursorRow[_Setting]]:
    """Return the rows that the details pane shows for a component.

    Args:
        component: description of the component.
        port: full name of the port under the cursor. Its connectors are the first rows.
    """
    rows = list(_connector_rows(component, port)) if port else []
    configuration = component["configuration"]
    if not configuration["parameters"]:
        rows.append(CursorRow("none", plain("no configuration parameters", DIM), _Setting()))
    for one in configuration["parameters"]:
        allowed = f"  [{one['constraint']}]" if one["constraint"] else ""
        line: Line = (
            (f"{one['name']} = ", ""),
            (f"{one['value']} {one['unit']}".rstrip(), "bold"),
            (allowed, DIM),
        )
        rows.append(
            CursorRow(f"holds {one['name']}", line, _Setting("", one["name"], one["value"]))
        )
    for set_id, values in configuration["sets"].items() if configuration["parameters"] else ():
        active = set_id == configuration["active"]
        mark = ("  active", _GOOD) if active else ("", "")
        rows.append(
            CursorRow(f"set {set_id}", (("set ", DIM), (set_id, "bold"), mark), _Setting(set_id))
        )
        for name, value in values.items():
            line = (f"  {name} = ", ""), (value, "bold")
            rows.append(CursorRow(f"set {set_id} {name}", line, _Setting(set_id, name, value)))
    return rows


def _connector_rows(component: Any, port: str) -> Iterator[CursorRow[_Setting]]:
    described = next((one for one in component["ports"] if one["name"] == port), None)
    if described is None:
        return
    data_type = described["data_type"].removeprefix("IDL:").removesuffix(":1.0")
    head = described["kind"], data_type.removeprefix("RTC/")
    yield CursorRow("port", ((" ".join(head).rstrip(), DIM),), _Setting())
    for interface in described["interfaces"]:
        text = f"{interface['polarity'].lower()} {interface['name']} ({interface['type']})"
        yield CursorRow(f"interface {interface['name']}", plain(text, DIM), _Setting())
    for connector in described["connectors"]:
        peer = next((one for one in connector["ports"] if one != port), port)
        kind = connector["properties"].get("dataport.subscription_type", "")
        lost = "  lost" if connector.get("state") == "lost" else ""
        line: Line = (("with ", DIM), (peer, _GOOD), (f"  {kind}", DIM), (lost, ALARM))
        yield CursorRow(f"connector {peer}", line, _Setting(peer=peer))


class SystemScreen(FramedApp):
    """Terminal editor for a running system: it draws the system, and changes it by keys and mouse.

    Args:
        link: link to the control socket of the system.
        name: name of the system, for display.
    """

    TITLE = "RT System Editor"
    HORIZONTAL_BREAKPOINTS: ClassVar[list[tuple[int, str]] | None] = [  # type: ignore[misc]
        (0, "-narrow"),
        (120, "-wide"),
    ]
    CSS = """
    SystemPicture, #details { border: round $secondary; }
    SystemPicture:focus, #details:focus { border: round $accent; }
    #panes { height: 1fr; }
    SystemPicture { height: 2fr; }
    #details { height: 1fr; min-height: 5; max-height: 12; }
    .-wide #panes { layout: horizontal; }
    .-wide SystemPicture { width: 1fr; height: 100%; }
    .-wide #details { width: 38; height: 100%; max-height: 100%; }
    #status { height: 1; background: $boost; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "request('activate')", "activate"),
        Binding("d", "request('deactivate')", "deactivate"),
        Binding("r", "request('reset')", "reset"),
        Binding("m", "mark", "mark"),
        Binding("c", "connect", "connect"),
        Binding("x", "disconnect", "disconnect"),
        Binding("e", "edit", "edit"),
        Binding("plus", "add_set", "new set", key_display="+"),
        Binding("ctrl+s", "save", "save", key_display="^s"),
    ]

    def __init__(self, link: SystemLink, name: str) -> None:
        super().__init__()
        self._link, self._socket = link, name
        self.view, self.details = SystemPicture(), CursorView[_Setting]("details")
        self.status = LineView("status")

    def compose(self) -> ComposeResult:
        """Lay out the panes."""
        with Container(id="panes"):
            yield self.view
            yield self.details
        yield self.status
        yield KeyFooter()

    def on_mount(self) -> None:
        """Start updating the screen."""
        self.status.can_focus = False
        self.view.focus()
        self.set_interval(PAINT_S, self.look)

    def look(self) -> None:
        """Update the screen with the present state of the system.

        The app calls this method ten times a second, and after each command.
        """
        for answer in self._link.take_answers():
            if answer.text:
                self.notify(answer.text, severity="error" if answer.refused else "information")
        components = self._link.components
        self.view.offer(*boxes_and_edges(components))
        self._frame()
        component = self._component()
        self.details.offer([] if component is None else _detail_rows(component, self.view.port))
        active = sum(one["state"] == "ACTIVE" for one in components)
        line: Line = (
            (f" {counted(len(components), 'component')}, {active} active  ", ""),
            (f"marked: {self.view.marked}  " if self.view.marked else "", LIT),
            (self._socket, DIM),
        )
        if self._link.problem:
            line = plain(f" the system is gone, waiting for it ({self._link.problem})", ALARM)
        self.status.show([line])

    def _frame(self) -> None:
        """Write the full names on the frames, because the picture cuts them."""
        self.view.frame("system as it was" if self._link.problem else "system", self.view.at)
        component = self._component()
        if component is None:
            self.details.title = "no component"
            return
        rates = "".join(f", {one['rate_hz']:g} Hz" for one in component["contexts"][:1])
        state = component["state"].capitalize()
        self.details.title = f"{component['name']}: {state}{rates}"

    def _component(self) -> Any:
        owner = self.view.owner
        return next((one for one in self._link.components if one["name"] == owner), None)

    def on_system_picture_moved(self) -> None:
        """Show the details of the component under the cursor."""
        self.look()

    def on_cursor_view_entered(self) -> None:
        """Edit the chosen row."""
        self.action_edit()

    def action_request(self, what: str) -> None:
        """Request a state of the component under the cursor."""
        if (owner := self.view.owner) and what in _MOVES:
            self._request(what, name=owner)

    def action_mark(self) -> None:
        """Mark a port, or remove the mark."""
        if not (port := self.view.port):
            self._refuse("ports can be marked: go to one with the arrows")
            return
        self.view.marked = "" if self.view.marked == port else port
        self.look()

    def action_connect(self) -> None:
        """Connect the marked port with the port under the cursor."""
        marked, port = self.view.marked, self.view.port
        if not marked:
            self._refuse("mark a port first (m)")
        elif not port:
            self._refuse("go to the other port")
        else:
            ends = [port, marked] if self.view.is_out else [marked, port]
            if self._request("connect", ports=ends):
                self.view.marked = ""
                self.look()

    def action_disconnect(self) -> None:
        """End the connector of the port under the cursor, or the chosen connector."""
        port, row = self.view.port, self.details.row
        peers = self.view.joined(port) if port else []
        if self.focused is self.details and row is not None and row.item.peer:
            peers = [row.item.peer]
        if not peers:
            self._refuse("go to a port that is connected")
        elif len(peers) == 1:
            self._request("disconnect", ports=[port, peers[0]])
        else:
            rows = [CursorRow(peer, plain(peer), peer) for peer in peers]
            ChoiceScreen(f"disconnect {port} from", rows).prompt(
                self, lambda peer: self._request("disconnect", ports=[port, peer])
            )

    def action_edit(self) -> None:
        """Ask the user for a new value of the parameter under the cursor, and set it.

        If the row under the cursor is a configuration set, activate the set instead.
        """
        component, row = self._component(), self.details.row
        if component is None or row is None or row.item == _Setting() or row.item.peer:
            self._refuse("go to a parameter or set in the details (Tab)")
            return
        name, (set_id, parameter, value, _) = component["name"], row.item
        if not parameter:
            self._request("activate_set", name=name, set=set_id)
            return

        def answered(words: str) -> None:
            self._request("set_parameter", name=name, parameter=parameter, value=words, set=set_id)

        where = f" of the set {set_id}" if set_id else ""
        QuestionScreen(f"{name}: {parameter}{where}", value).prompt(self, answered)

    def action_add_set(self) -> None:
        """Ask for a name, and add a configuration set that copies the set under the cursor."""
        component, row = self._component(), self.details.row
        if component is None or not component["configuration"]["parameters"]:
            self._refuse("go to a component with parameters")
            return
        name, like = component["name"], component["configuration"]["active"]
        if row is not None and row.item.set_id:
            like = row.item.set_id

        def answered(set_id: str) -> None:
            self._request("add_set", name=name, set=set_id.strip(), like=like)

        QuestionScreen(f"{name}: new set with the values of {like}", "").prompt(self, answered)

    def action_save(self) -> None:
        """Ask for a file, and write the system in its present state."""

        def answered(path: str) -> None:
            if not path:
                return
            try:
                form = file_format(Path(path))
            except Refused as error:
                self._refuse(error.message)
                return
            self._request("save", _written(Path(path)), format=form)

        QuestionScreen("save the system as (.toml, .xml)", "system.toml").prompt(self, answered)

    def _request(
        self, do: str, then: Callable[[Object], str] | None = None, **fields: object
    ) -> bool:
        """Send a request to the system. Return False if the system is not available."""
        if self._link.problem:
            return self._refuse("the system is gone: nothing was done")
        self._link.request(do, then, **fields)
        return True

    def _refuse(self, why: str) -> bool:
        self.notify(why, severity="error")
        return False


def _written(path: Path) -> Callable[[Object], str]:
    def write(answer: Object) -> str:
        write_whole(path, str(answer["text"]))
        return f"saved: {path}"

    return write


def edit_system(at: Path) -> None:
    """Show a running system in the terminal editor until the user ends the editor.

    Args:
        at: control socket of the system.

    Raises:
        Refused: no system answers, or there is no terminal.
    """
    request_system(at, "status")
    if not sys.stdout.isatty():
        raise Refused("the editor needs a terminal; tickrig rtc ls, con, dis and act do without")
    link = SystemLink(at)
    screen = SystemScreen(link, str(at))
    with screen.ended_by_signals():
        link.start()
        try:
            screen.run()
        finally:
            link.close()
