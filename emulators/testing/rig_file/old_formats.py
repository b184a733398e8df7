"""Files of before the rig file, put into its words: CANopen rigs, and where a real RRC is.

Each value keeps the line and the name that it has in its file, for mistakes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.canopen.node_spec import LSS, parse_ids
from tickrig.emulators.canopen.rig_file import DEVICE_KEYS, NODE_KEYS
from tickrig.host.cli.messages import Refused
from tickrig.host.text.names import closest
from tickrig.host.text.section import Notes, Section, dotted, is_broken, shown
from tickrig.host.text.toml_reader import BROKEN, TomlDocument, TomlPath
from tickrig.host.text.trace import BEGIN

_SYSTEM: Final = (
    "it is a system of RT components, of which nothing is emulated: tickrig rtc run FILE"
)
SCENARIO: Final = "it is a scenario: --scenario FILE plays it"
_TRACE: Final = "it is a trace: tickrig replay FILE, tickrig compare FILE"
EDS: Final = "it is an EDS or DCF: a rig file names it as the type of a device, type = FILE"
_URDF: Final = (
    "it is a URDF: a bus.yml names it, options: {tickrig: {urdf: FILE}}, and tickrig check of that"
    " checks both"
)
_EDS: Final = re.compile(r"\s*\[(FileInfo|DeviceInfo|DeviceComissioning)\]", re.IGNORECASE)
_HEAD: Final = 2_000
"""Characters at its beginning by which a URDF is known."""
_SCENARIO: Final = re.compile(
    r"(?:[^\S\n]*+(?:#.*+)?\n)*+[^\S\n]*+\+?[0-9][0-9.]*(s|ms|us)?[ \t]+[a-z]+\b(?!\s*=)"
)
_HIL: Final = {
    ("dut", "rrc", "port"): ("hardware", "rrc", "port"),
    ("tolerance", "stick_pct"): ("hardware", "tolerance", "stick_pct"),
    ("tolerance", "time_ms"): ("hardware", "tolerance", "time_ms"),
    ("operator", "control"): ("hardware", "control"),
}
"""What becomes of the keys of the file for tests on a real RRC."""


def no_rig_file(text: str) -> str:
    r"""Say what a text is that no bench can be made of; empty if nothing is known of it.

    >>> no_rig_file("# drive\n0.1s press power_button\n")
    'it is a scenario: --scenario FILE plays it'
    """
    if text.startswith(BEGIN):
        return _TRACE
    if _EDS.match(text):
        return EDS
    head = text[:_HEAD].lstrip("\ufeff \t\r\n")
    if head.startswith("<") and "<robot" in head:
        return _URDF
    return SCENARIO if _SCENARIO.match(text) else ""


@dataclass(slots=True)
class _Translation:
    """A document in the words of rig files, and what is wrong with the old one."""

    old: Section
    values: dict[str, Any] = field(default_factory=dict)
    lines: dict[TomlPath, int] = field(default_factory=dict)
    names: dict[TomlPath, str] = field(default_factory=dict)

    def put(self, keys: TomlPath, value: Any, old: TomlPath) -> None:
        """Enter a value that stood somewhere else."""
        table = self.values
        for at, key in enumerate(keys[:-1], 1):
            table = table.setdefault(str(key), {})
            self._place(keys[:at], old[:-1])
        table[str(keys[-1])] = value
        self._place(keys, old)

    def _place(self, keys: TomlPath, old: TomlPath) -> None:
        self.lines.setdefault(keys, self.old.notes.document.line_of(old))
        self.names.setdefault(keys, dotted(old))

    @property
    def section(self) -> Section:
        """The document as a section, with the mistakes of the old one."""
        old = self.old.notes
        document = TomlDocument(self.values, self.lines, old.document.mistakes, old.document.whole)
        return Section(Notes(document, old.mistakes, self.names), (), self.values)


def in_new_words(top: Section) -> Section:
    """Return an old file as if it were a rig file, a rig file as it is.

    Args:
        top: the whole file.
    """
    given = top.values
    if "device" in given:
        return top
    if isinstance(given.get("node"), list):
        return _canopen_rig(top)
    if isinstance(given.get("dut"), dict):
        return _hil(top)
    if isinstance(given.get("component"), list):
        top.wrong(_SYSTEM, "component")
        return Section(top.notes, (), {"device": {}})
    return top


def _hil(top: Section) -> Section:
    """Read the file that tells where a real RRC is."""
    new = _Translation(top)
    new.put(("device", "rrc", "type"), "rrc", ("dut", "rrc"))
    new.put(("hardware", "rrc"), {}, ("dut", "rrc"))
    _check_keys(top, [keys[0] for keys in _HIL])
    dut = top.sub("dut")
    for table in (dut, top.sub("tolerance"), top.sub("operator"), dut and dut.sub("rrc")):
        if table is not None:
            depth = len(table.keys)
            known = [keys[depth] for keys in _HIL if keys[:depth] == table.keys]
            if _check_keys(table, known) & {"rrc", "port"}:
                new.put(_HIL["dut", "rrc", "port"], BROKEN, ("dut", "rrc"))
    for old, keys in _HIL.items():
        if (value := _value(top.values, old)) is not None:
            new.put(keys, value, old)
    return new.section


def _check_keys(section: Section, known: Iterable[str]) -> set[str]:
    """Note the keys that are not known, and return those that may be meant."""
    known = list(dict.fromkeys(known))
    unknown = [key for key in section.values if key not in known]
    for key in unknown:
        section.no_key(key, known)
    return {each for key in unknown for each in closest(key, known)}


def _value(values: Mapping[str, Any], keys: TomlPath) -> Any:
    value: Any = values
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return value


def _canopen_rig(top: Section) -> Section:
    """Read tables [[node]] and [body]."""
    new = _Translation(top)
    for at, table in enumerate(top.values["node"]):
        if isinstance(table, dict):
            section = Section(top.notes, ("node", at), table)
            for name, values in _nodes(section, list(new.values.get("device", {}))):
                for key, (value, old) in values.items():
                    new.put(("device", name, key), value, ("node", at, *old))
        elif table is not BROKEN:
            top.wrong(f"it is a table [[node]], not {shown(table)}", "node", at)
    new.values.setdefault("device", {})
    for key, value in top.values.items():
        if key == "body":
            for inner, each in value.items() if isinstance(value, dict) else ():
                new.put(("body", inner), each, ("body", inner))
        elif key != "node":
            new.put((key,), value, (key,))
    return new.section


_Keys = dict[str, tuple[Any, TomlPath]]
"""Values by their keys, with the keys that they had."""


def _nodes(section: Section, taken: list[str]) -> Iterator[tuple[str, _Keys]]:
    """Yield the nodes of a table: each name, and its keys with what they were."""
    given = section.values
    misspelt = _check_keys(section, NODE_KEYS)
    devices = [key for key in DEVICE_KEYS if key in given]
    if len(devices) != 1:
        if devices or not misspelt & {*DEVICE_KEYS}:
            section.wrong(f"it has one of {', '.join(DEVICE_KEYS)}")
        return
    values: _Keys = {"type": (given[devices[0]], (devices[0],))}
    if "profile" in given:
        values["profile"] = given["profile"], ("profile",)
    if "id" not in given or is_broken(given["id"]):
        model = MODELS.get(given[devices[0]]) if isinstance(given[devices[0]], str) else None
        yield str(model.node_id) if model else f"node{len(taken) + 1}", values
        return
    try:
        ids = list(parse_ids(f"id {shown(given['id'])}", str(given["id"])))
    except Refused as error:
        section.wrong(str(error), "id")
        return
    for number in ids:
        waits = given["id"] == LSS
        count = sum(each.startswith(LSS) for each in taken)
        name = str(number) if not waits else f"{LSS}{count + 1}" if count else LSS
        if name in taken:
            section.wrong(f"node {name} is there twice", "id")
        else:
            yield name, {**values, "node_id": (LSS if waits else number, ("id",))}
