"""The settings screen for buses, files, filter and alarms, which can change while the monitor runs.

>>> parse_settings({**EMPTY, "source": "can0 can1", "bitrate": "500k"}).setup.source
('can0', 'can1')
>>> parse_settings({**EMPTY, "source": "can0", "bitrate": "fast"})
Traceback (most recent call last):
    ...
tickrig.host.canmon.tui.settings.InputError: 'fast' is not a bit rate like 500000, 500k or 1M
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from glob import escape, iglob
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.screen import ModalScreen
from textual.suggester import Suggester
from textual.widgets import Input, Label, Static, TextArea

from tickrig.host.canmon.eds_document import eds_paths, read_eds_folders
from tickrig.host.canmon.extensions import load_rule
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.sources.source import parse_source
from tickrig.host.canmon.workspace import MonitorSetup
from tickrig.host.cli.can_options import BusOptions, check_interface, parse_bit_rate
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.text.toml_reader import load_toml
from tickrig.host.tui import KeyFooter

# Theory of operation
# ===================
#
# A field is a text, as on the command line; `setting_texts` writes what is used now, and
# `parse_settings` reads it back. What is wrong belongs to one field: a `InputError` has its
# name, and the screen shows the reason below it. Reading the text finds most mistakes; the
# rest, as a bus that cannot be opened, is found when the settings are applied. So the screen
# hands what it has read to the program (`apply`), stays if that raises, and else leaves.
# Nothing has changed before, and Escape needs to undo nothing.

_LINES: Final = {
    "source": ("bus or file", "as can0, slcan:/dev/ttyACM0@500k, run.log"),
    "interface": ("interface", "as socketcan, udp_multicast, slcan"),
    "channel": ("channel", "as can0, in place of a bus above"),
    "bitrate": ("bit rate", "as 500k"),
    "data_bitrate": ("data bit rate", "as 2M, of CAN FD frames with BRS"),
    "bus_kwargs": ("driver options", "as port=43113"),
    "eds_dir": ("EDS folders", "as eds: files for other nodes, by their identity"),
    "dbc": ("DBC files", "as car.dbc"),
    "filter": ("trace filter", "as node=3 and (pdo or emcy)"),
}
"""Fields of one line, with the label and the text in an empty field."""

_AREAS: Final = {"eds": ("EDS of nodes", 3), "rules": ("alarms", 6)}
"""Fields of several lines, with the label and the number of visible lines."""

_ORDER: Final = (*list(_LINES)[:6], "eds", *list(_LINES)[6:], "rules")
EMPTY: Final = dict.fromkeys(_ORDER, "")
"""Texts of all fields, which are empty."""

_PATHS: Final = ("source", "eds_dir", "dbc")


class InputError(ValueError):
    """An invalid field.

    Attributes:
        field: name of the field.
    """

    def __init__(self, field: str, reason: str) -> None:
        super().__init__(reason)
        self.field = field


@dataclass(frozen=True, slots=True)
class MonitorSettings:
    """The settings that the user can change on the settings screen of the monitor.

    Attributes:
        setup: sources and files of the monitor.
        filter: filter expression of the trace tab.
        rules: rules of the alarms as TOML text.
    """

    setup: MonitorSetup
    filter: str = ""
    rules: str = ""


@contextmanager
def of_field(name: str) -> Iterator[None]:
    """Turn errors in the block into an InputError of a field."""
    try:
        yield
    except InputError:
        raise
    except (Refused, SourceFailed) as error:
        reason = error.message
        for option in ("--eds ", "--eds-dir ", "--dbc ", "-i "):
            reason = reason.removeprefix(option)
        raise InputError(name, reason) from None
    except OSError as error:
        raise InputError(name, f"{error.filename}: {error.strerror}") from None
    except ValueError as error:
        raise InputError(name, str(error)) from None


def setting_texts(settings: MonitorSettings) -> dict[str, str]:
    """Return the text of each field."""
    setup, options = settings.setup, settings.setup.options
    eds = [f"{node}={path}" for node, path in sorted(setup.eds.items())]
    return {
        "source": shlex.join(setup.source),
        "interface": options.interface or "",
        "channel": options.channel or "",
        "bitrate": str(options.bitrate or ""),
        "data_bitrate": str(options.data_bitrate or ""),
        "bus_kwargs": shlex.join(options.bus_kwargs),
        "eds": "\n".join(eds),
        "eds_dir": shlex.join(map(str, setup.eds_dir)),
        "dbc": shlex.join(map(str, setup.dbc)),
        "filter": settings.filter,
        "rules": settings.rules,
    }


def parse_settings(texts: Mapping[str, str], before: MonitorSetup | None = None) -> MonitorSettings:
    """Parse the texts that the user entered into the fields of the settings screen.

    Args:
        texts: text of each field by its name.
        before: present settings. Options that have no field on the screen are kept.

    Raises:
        InputError: the text of a field is invalid.
    """
    words = {name: _words(name, texts[name]) for name in (*_PATHS, "bus_kwargs")}
    with of_field("source"):
        for word in words["source"]:
            parse_source(word)
        if not (words["source"] or texts["interface"] or texts["channel"]):
            raise ValueError("nothing to listen to: a bus as can0, or a log file as run.log")
    with of_field("interface"):
        check_interface(texts["interface"] or None)
    with of_field("bus_kwargs"):
        if wrong := [word for word in words["bus_kwargs"] if "=" not in word[1:]]:
            raise ValueError(f"{wrong[0]!r} is not KEY=VALUE, as port=43113")
    with of_field("eds"):
        eds = eds_paths([line.strip() for line in texts["eds"].splitlines() if line.strip()])
    folders = tuple(map(Path, words["eds_dir"]))
    with of_field("eds_dir"):
        read_eds_folders(folders)
    with of_field("filter"):
        if texts["filter"]:
            parse_filter(texts["filter"])
    with of_field("rules"):
        parse_rules(load_toml(texts["rules"]), load_rule)
    options = replace(
        before.options if before else BusOptions(),
        interface=texts["interface"] or None,
        channel=texts["channel"] or None,
        bus_kwargs=words["bus_kwargs"],
        bitrate=_bit_rate("bitrate", texts["bitrate"]),
        data_bitrate=_bit_rate("data_bitrate", texts["data_bitrate"]),
    )
    setup = MonitorSetup(
        source=words["source"],
        options=options,
        eds=eds,
        dbc=tuple(map(Path, words["dbc"])),
        eds_dir=folders,
    )
    return MonitorSettings(setup, texts["filter"], texts["rules"])


def _words(name: str, text: str) -> tuple[str, ...]:
    with of_field(name):
        return tuple(shlex.split(text))


def _bit_rate(name: str, text: str) -> int | None:
    with of_field(name):
        return parse_bit_rate(text) if text else None


class _FileSuggester(Suggester):
    """Suggester that completes the last word of a field as a file name.

    The right key accepts it.
    """

    async def get_suggestion(self, value: str) -> str | None:
        """Return the text of the field, completed with the first file name that fits."""
        begun = value.rpartition(" ")[2]
        found = list(islice(iglob(f"{escape(begun)}*"), 100)) if begun else []
        return f"{value}{min(found)[len(begun) :]}" if found else None


class SettingsScreen(ModalScreen[None]):
    """The settings screen of the monitor, with an error message below each invalid field.

    Args:
        settings: the present settings.
        apply: function that is called with the entered settings. It raises InputError if the
            settings cannot be used.
    """

    HELP = """
# settings

A field is as on the command line of `canmon tui`. **F5**, or **Enter** in a line, applies
all of them; **Escape** leaves everything as it is. If a value is wrong, or a bus cannot be
opened, the reason stands below its field, and what ran goes on.

`EDS of nodes` has a line `NODE=FILE`, as `3=drive.eds` or `1-3=drive.eds`, for each file.
`alarms` has the rules of `canmon check` as TOML. In a field with files the right arrow takes
the name that is proposed.
"""
    DEFAULT_CSS = """
    SettingsScreen VerticalScroll { scrollbar-size-vertical: 1; }
    SettingsScreen #title { text-style: bold; width: 1fr; }
    SettingsScreen Horizontal { height: auto; }
    SettingsScreen Label { width: 16; color: $text-muted; }
    SettingsScreen Input { width: 1fr; height: 1; border: none; padding: 0; }
    SettingsScreen TextArea { width: 1fr; border: none; padding: 0; }
    SettingsScreen .wrong { display: none; height: auto; color: $error; padding: 0 0 0 16; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f5", "apply", "apply", key_display="F5", priority=True),
        Binding("escape", "leave", "cancel", key_display="Esc"),
        Binding("f1", "app.help", "help", key_display="F1"),
        Binding("tab", "app.focus_next", "next field", key_display="Tab"),
    ]

    def __init__(self, settings: MonitorSettings, apply: Callable[[MonitorSettings], Any]) -> None:
        super().__init__(id="settings")
        self._settings, self._apply = settings, apply
        self._texts = setting_texts(settings)

    def compose(self) -> ComposeResult:
        """Lay out the fields."""
        with VerticalScroll(can_focus=False):
            yield Static("settings", id="title", markup=False)
            for name in _ORDER:
                with Horizontal():
                    label = _LINES[name][0] if name in _LINES else _AREAS[name][0]
                    yield Label(label, markup=False)
                    yield self._field(name)
                yield Static(id=f"wrong-{name}", classes="wrong", markup=False)
        yield KeyFooter()

    def _field(self, name: str) -> Input | TextArea:
        if name in _AREAS:
            area = TextArea(
                self._texts[name], id=f"field-{name}", tab_behavior="focus", compact=True
            )
            area.styles.height = _AREAS[name][1]
            return area
        suggester = _FileSuggester(use_cache=False) if name in _PATHS else None
        return Input(
            self._texts[name],
            _LINES[name][1],
            id=f"field-{name}",
            compact=True,
            select_on_focus=False,
            suggester=suggester,
        )

    def on_mount(self) -> None:
        """Set the focus to the bus."""
        self.query_one("#field-source").focus()

    def on_input_submitted(self) -> None:
        """Apply all fields."""
        self.action_apply()

    def action_apply(self) -> None:
        """Apply all fields, or show the error of a field."""
        for one in self.query(".wrong"):
            one.display = False
        try:
            self._apply(parse_settings(self._read(), self._settings.setup))
        except InputError as error:
            self._show(error)
            return
        self.dismiss()

    def action_leave(self) -> None:
        """Leave the screen without a change."""
        self.dismiss()

    def _read(self) -> dict[str, str]:
        texts = {}
        for name in _ORDER:
            field = self.query_one(f"#field-{name}")
            assert isinstance(field, Input | TextArea)
            texts[name] = field.text if isinstance(field, TextArea) else field.value.strip()
        return texts

    def _show(self, error: InputError) -> None:
        wrong = self.query_one(f"#wrong-{error.field}", Static)
        wrong.update(str(error))
        wrong.display = True
        self.query_one(f"#field-{error.field}").focus()
        self.call_after_refresh(wrong.scroll_visible, animate=False)
