"""The slaves of a bus.yml: each made of its EDS, as the master of that file will expect it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from tickrig.emulators.canopen.bus_file.mistake import BusMistakesError, Mistake
from tickrig.emulators.canopen.bus_file.node_keys import URDF
from tickrig.emulators.canopen.bus_file.node_maker import BusNode, NodeMaker
from tickrig.emulators.canopen.bus_file.urdf import Urdf, read_urdf
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.eds import EdsCache, Version, version_of
from tickrig.host.canopen.bus_file.bus_file import BusFile, read_bus_file
from tickrig.host.canopen.bus_file.item import Place
from tickrig.host.canopen.bus_file.notes import Notes
from tickrig.host.canopen.data_sheet.rule import RuleFinding


@dataclass(frozen=True, slots=True)
class BusNodes:
    """The slaves of a bus.

    Attributes:
        nodes: in the order of the file.
        remarks: what is odd, a line each.
    """

    nodes: tuple[BusNode, ...]
    remarks: tuple[str, ...] = ()


def read_bus(
    path: Path,
    urdf: Path | None = None,
    cache: EdsCache | None = None,
    profile: str = AUTO,
) -> BusNodes:
    """Read a bus.yml, the files that it names, and make its slaves once.

    Args:
        path: the bus.yml.
        urdf: the robot with the joints; that of `options: tickrig:` unless given.
        cache: of EDS files; it keeps the slaves, too.
        profile: of `choices.PROFILES`, for nodes that name none.

    Raises:
        OSError: the bus.yml or the URDF cannot be read.
        BusMistakesError: all that is wrong.
    """
    cache = cache or EdsCache()
    versions, found = cache.others.get((path, urdf, profile), ({}, None))
    if isinstance(found, BusNodes) and all(_is_same(*each) for each in versions.items()):
        return found
    bus = read_bus_file(path)
    found = _nodes_of(bus, urdf, cache, profile)
    files = {path, *(file for node in found.nodes for file in node.description.files)}
    versions = {file: version_of(file) for file in sorted(files)}
    cache.others[path, urdf, profile] = versions, found
    return found


def check_nodes(bus: BusFile) -> tuple[RuleFinding, ...]:
    """Return what is wrong or odd beside the findings of the file: in `tickrig:`, the robot, ...

    Args:
        bus: the file; one without slaves has nothing to be made.
    """
    if not bus.slaves:
        return ()
    told = {Place(one.file, one.line) for one in bus.errors}
    made = _made(bus, None, EdsCache(), AUTO)
    notes = Notes()
    for rule, found in (("tickrig", made.mistakes), ("joint", made.remarks)):
        for place, text in sorted(found):
            if place not in told:
                notes.note(rule, place, "", text)
    return notes.all


def _is_same(file: Path, version: Version) -> bool:
    try:
        return version_of(file) == version
    except OSError:
        return False


class _Made(NamedTuple):
    """What became of a file: its slaves, what is wrong, what is odd, what is added."""

    nodes: tuple[BusNode, ...]
    mistakes: list[Mistake]
    remarks: list[Mistake]
    added: list[Mistake]


def _made(bus: BusFile, urdf: Path | None, cache: EdsCache, profile: str) -> _Made:
    mistakes: list[Mistake] = []
    robot = None
    try:
        robot = _robot(bus, urdf)
    except BusMistakesError as error:
        mistakes += error.mistakes
    maker = NodeMaker(bus, robot, cache, mistakes, profile)
    return _Made(tuple(maker.nodes()), mistakes, maker.remarks, maker.added)


def _nodes_of(bus: BusFile, urdf: Path | None, cache: EdsCache, profile: str) -> BusNodes:
    made = _made(bus, urdf, cache, profile)
    mistakes = [Mistake(Place(one.file, one.line), _said(one)) for one in bus.errors]
    mistakes += made.mistakes
    if mistakes:
        raise BusMistakesError(mistakes)
    if not bus.slaves:
        raise BusMistakesError([Mistake(Place(str(bus.path), 1), "no node with a dcf")])
    remarks = tuple(map(str, (*bus.warnings, *made.remarks, *made.added)))
    return BusNodes(made.nodes, remarks)


def _said(one: Any) -> str:
    where = f"{one.section}: " if one.section else ""
    return f"{where}{one.text}; fix: {one.rule.fix} ({one.rule.name})"


def _robot(bus: BusFile, urdf: Path | None) -> Urdf | None:
    """Return the robot that is named, None if none is."""
    if urdf is not None:
        return read_urdf(urdf)
    item = bus.options.extra.get(URDF)
    if item is None:
        return None
    if not isinstance(item.value, str) or not item.value or "\0" in item.value:
        raise BusMistakesError([Mistake(item.place, f"options.tickrig.urdf: {item} is no file")])
    file = bus.path.parent / item.value
    try:
        return read_urdf(file)
    except OSError as error:
        text = f"options.tickrig.urdf: {file}: {error.strerror}"
        raise BusMistakesError([Mistake(item.place, text)]) from None
