"""A bus.yml in the words of rig files: each of its nodes is a device on the bus."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

from tickrig.emulators.canopen import late
from tickrig.emulators.testing.rig_file.probe import eds_cache
from tickrig.host.text.section import Notes, Section, shown
from tickrig.host.text.toml_reader import Mistake, TomlDocument, TomlPath

_BUS: Final = "bus"
"""The key of a rig file that names a bus.yml."""

_MISNAMED: Final = "it is a bus.yml: its name has to end in .yml or .yaml"
_TOML: Final = re.compile(rb"^[ \t]*+\[", re.MULTILINE)


def is_bus_yml(path: Path, data: bytes) -> bool:
    """Return whether a file is a bus.yml, a good or a bad one; not what only its name says."""
    return late.is_bus_file(data) or (_is_named(path) and not _TOML.search(data))


def _is_named(path: Path) -> bool:
    return path.suffix.lower() in (".yml", ".yaml")


def bus_as_rig(path: Path) -> Section:
    """Return a bus.yml as if it were a rig file with its nodes alone.

    Raises:
        OSError: it cannot be read.
    """
    document = TomlDocument({_BUS: path.name}, {(_BUS,): 1})
    if not _is_named(path):
        return Section(Notes(document, [Mistake(1, _MISNAMED)]), (), {"device": {}})
    return with_nodes(Section(Notes(document), (), document.values), path.parent, alone=True)


def with_nodes(top: Section, folder: Path, *, alone: bool = False) -> Section:
    """Return a rig file in which each node of the bus.yml that it names is a device.

    What the file says of a device of the same name is kept.

    Args:
        top: the whole file.
        folder: where the bus.yml is looked for.
        alone: there is only the bus.yml, and what cannot be read is an OSError.
    """
    given = top.values.get(_BUS)
    if given is None:
        return top
    if not isinstance(given, str) or not given or "\0" in given:
        top.wrong(f"it takes the name of a bus.yml, not {shown(given)}", _BUS)
        return top
    places: dict[str, int] = {}
    try:
        places = _places(top, folder / given, alone=alone)
    except OSError as error:
        if alone:
            raise
        top.wrong(f"{folder / given}: {error.strerror}", _BUS)
    return _merged(top, given, places)


def _places(top: Section, path: Path, *, alone: bool) -> dict[str, int]:
    """Return the lines of the nodes by their names; what is wrong is noted."""
    try:
        bus = late.read_bus(path, cache=eds_cache())
    except ImportError as error:
        top.wrong(str(error), _BUS)
        return {}
    except late.BusMistakesError as error:
        for place, text, _ in error.mistakes:
            own = alone and place.file == str(path)
            line = place.line if own else top.notes.document.line_of((_BUS,))
            top.notes.mistakes.append(Mistake(line, text if own else f"{place}: {text}"))
        return {}
    return {node.name: node.line for node in bus.nodes}


def _merged(top: Section, bus: str, nodes: dict[str, int]) -> Section:
    """Return the document with a device for each node."""
    old = top.notes.document
    devices: Any = top.values.get("device", {})
    if not isinstance(devices, dict):
        return top
    own = {name: devices.get(name, {}) for name in nodes}
    found = {
        name: {"type": f"{bus}:{name}", **table}
        for name, table in own.items()
        if isinstance(table, dict)
    }
    lines, names = dict(old.lines), dict[TomlPath, str]()
    for name in nodes:
        names["device", name] = f"{_BUS} {name}" if name not in devices else ""
        lines.setdefault(("device", name), old.line_of((_BUS,)))
    values = {key: each for key, each in top.values.items() if key != _BUS}
    values["device"] = {**found, **{k: v for k, v in devices.items() if k not in found}}
    document = TomlDocument(values, lines, old.mistakes, old.whole)
    return Section(Notes(document, top.notes.mistakes, names), (), values)
