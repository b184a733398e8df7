"""The two layouts of a bus.yml: that of dcfgen, and that of cogen with `defaults` and `nodes`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple, cast

from tickrig.host.canopen.bus_file.item import Item, Key, Place
from tickrig.host.canopen.bus_file.notes import Notes, Section
from tickrig.wire.canopen.eds.eds_file import shorten

OPTIONS: Final = "options"
MASTER: Final = "master"
DEFAULTS: Final = "defaults"
NODES: Final = "nodes"
COGEN: Final = (OPTIONS, MASTER, DEFAULTS, NODES)


class Layout(NamedTuple):
    """The sections of a file as dcfgen gets them.

    Attributes:
        options: None where there are none.
        master: None where there is none.
        slaves: by name, in the order of dcfgen.
        hidden: what begins with a dot, where dcfgen reads the file as it is.
    """

    options: Section | None
    master: Section | None
    slaves: dict[str, Section]
    hidden: tuple[Section, ...]


def read_layout(tree: Item, notes: Notes) -> Layout:
    """Find the sections of a file.

    What begins with a dot is no node: anchors stand there. As cogen does it, `defaults` count more
    than what a node says, and all keys are sorted.
    """
    top = Section(notes, "", tree, tree.place)
    ends = _optional(top, OPTIONS), _optional(top, MASTER)
    if NODES in top or DEFAULTS in top:
        return Layout(*ends, _cogen_nodes(top), ())
    nodes = {
        name: Section(notes, shorten(name), item, top.place_of(key))
        for key, name, item in _named(top, top.fields)
        if name not in {OPTIONS, MASTER}
    }
    hidden = [name for name in nodes if name.startswith(".")]
    return Layout(*ends, nodes, tuple(nodes.pop(name) for name in hidden))


def _optional(top: Section, key: str) -> Section | None:
    item = top.fields.get(key)
    return None if item is None else Section(top.notes, key, item, top.place_of(key))


def _cogen_nodes(top: Section) -> dict[str, Section]:
    for key in top.fields:
        if key not in COGEN and not str(key).startswith("."):
            text = f"{shorten(str(key))!r} stands beside nodes: it is dropped"
            top.note("section-lost", key, text)
    if NODES not in top:
        top.note("no-nodes", DEFAULTS, "defaults, but no nodes: that they are for")
        return {}
    nodes = Section(top.notes, NODES, top.fields[NODES], top.place_of(NODES))
    defaults = _optional(top, DEFAULTS)
    return {
        name: Section(
            top.notes, shorten(name), _with_defaults(top.notes, name, item, defaults), place
        )
        for key, name, item in sorted(_named(nodes, nodes.fields), key=lambda row: row[1])
        for place in (nodes.place_of(key),)
    }


def _named(section: Section, fields: Mapping[Key, Item]) -> Iterable[tuple[Key, str, Item]]:
    """Give the nodes; one whose name is no text is noted."""
    for key, item in fields.items():
        if isinstance(key, str):
            yield key, key, item
        else:
            section.note("kind", key, f"{key}: the name of a node is a text")


def _with_defaults(notes: Notes, name: str, item: Item, defaults: Section | None) -> Item:
    """Return a node as cogen writes it."""
    if defaults is None or not item.is_mapping:
        return _sorted(item)
    for key in defaults.fields.keys() & item.fields.keys():
        if item.fields[key] is not defaults.fields[key]:
            text = f"{key} is that of defaults: {defaults.fields[key].place}"
            notes.note("defaults-win", item.keys[key], shorten(name), text)
    fields = {**item.fields, **defaults.fields}
    keys: dict[Key, Place] = {
        **item.keys,
        **{key: defaults.place_of(key) for key in defaults.fields},
    }
    return _sorted(Item(fields, item.place, keys=keys))


def _sorted(item: Item) -> Item:
    """Return a mapping with sorted keys, also in its mappings, as PyYAML writes it."""
    if not item.is_mapping:
        return item
    try:
        keys: list[Any] = sorted(cast(Any, item.fields))  # keys of two kinds raise
    except TypeError:
        keys = list(item.fields)
    fields = {key: _sorted(item.fields[key]) for key in keys}
    return Item(fields, item.place, item.text, item.keys)
