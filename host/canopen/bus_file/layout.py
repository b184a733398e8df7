"""The two layouts of a bus.yml: that of dcfgen, and that of cogen with `defaults` and `nodes`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple, cast

from tickrig.host.canopen.bus_file.notes import BusFileNotes, BusFileSection
from tickrig.host.text.document import FilePlace, Item, Key
from tickrig.wire.canopen.eds.eds_file import shorten

OPTIONS: Final = "options"
MASTER: Final = "master"
_DEFAULTS: Final = "defaults"
_NODES: Final = "nodes"
_COGEN: Final = (OPTIONS, MASTER, _DEFAULTS, _NODES)


class Layout(NamedTuple):
    """The sections of a bus.yml, found in the same way as dcfgen finds them.

    A bus.yml is written for one of two programs. dcfgen reads nodes at the top level of the file.
    cogen reads nodes in the section `nodes`, and writes a file for dcfgen.

    Attributes:
        options: section `options`, or None if the file has none.
        master: section `master`, or None if the file has none.
        slaves: sections of the slaves by name, in the order of dcfgen.
        hidden: file and line of each top-level key that begins with a dot, by key. The dictionary
            is empty for a file that is written for cogen, because dcfgen never sees these keys.
        defaults: section whose keys cogen copies to all nodes, or None if the file has none.
    """

    options: BusFileSection | None
    master: BusFileSection | None
    slaves: dict[str, BusFileSection]
    hidden: dict[str, FilePlace]
    defaults: BusFileSection | None = None


def read_layout(tree: Item, notes: BusFileNotes) -> Layout:
    """Find the sections of options, master and slaves in a bus.yml.

    A bus.yml is written for one of two programs. In a file for dcfgen, a top-level key that begins
    with a dot is not a node, because its value only defines YAML anchors. A file with a section
    `nodes` or `defaults` is for cogen, which converts it to a file for dcfgen. This function does
    the same conversion: the keys in `defaults` replace the same keys of each node, and then all
    keys are sorted.
    """
    top = BusFileSection(notes, "", tree, tree.place)
    ends = _optional(top, OPTIONS), _optional(top, MASTER)
    if _NODES in top or _DEFAULTS in top:
        return Layout(*ends, _cogen_nodes(top), {}, _optional(top, _DEFAULTS))
    names = list(_named(top))
    hidden = {key: top.place_of(key) for key in names if key.startswith(".")}
    nodes = (key for key in names if key not in {OPTIONS, MASTER, *hidden})
    return Layout(*ends, {key: _section(top, key) for key in nodes}, hidden)


def _optional(top: BusFileSection, key: str) -> BusFileSection | None:
    return _section(top, key) if key in top else None


def _section(top: BusFileSection, key: str) -> BusFileSection:
    return BusFileSection(top.notes, shorten(key), top.fields[key], top.place_of(key))


def _cogen_nodes(top: BusFileSection) -> dict[str, BusFileSection]:
    for key in top.fields:
        if key not in _COGEN and not str(key).startswith("."):
            text = f"{shorten(str(key))!r} is beside nodes; cogen drops it"
            top.note("section-lost", key, text)
    if _NODES not in top:
        top.note("no-nodes", _DEFAULTS, "defaults, but no nodes to apply them to")
        return {}
    nodes = _section(top, _NODES)
    defaults = _optional(top, _DEFAULTS)
    found = {}
    for name in sorted(_named(nodes)):
        item = _sorted(_with_defaults(top.notes, name, nodes.fields[name], defaults), {})
        found[name] = BusFileSection(top.notes, shorten(name), item, nodes.place_of(name))
    return found


def _named(section: BusFileSection) -> Iterator[str]:
    """Yield the names of nodes. Report names that are not text."""
    for key in section.fields:
        if isinstance(key, str):
            yield key
        else:
            section.wrong("kind", key, "the name of a node must be a text")


def _with_defaults(
    notes: BusFileNotes, name: str, item: Item, defaults: BusFileSection | None
) -> Item:
    """Return a node with all defaults merged in."""
    if defaults is None or not item.is_mapping:
        return item
    for key, own in item.fields.items():
        usual = defaults.fields.get(key, own)
        if usual is not own:
            text = f"{shorten(str(key))} is overridden by defaults: {usual.place}"
            notes.note("defaults-win", item.keys[key], shorten(name), text)
    keys: dict[Key, FilePlace] = {
        **item.keys,
        **{key: defaults.place_of(key) for key in defaults.fields},
    }
    return Item({**item.fields, **defaults.fields}, item.place, keys=keys)


def _sorted(item: Item, done: dict[int, Item]) -> Item:
    """Return a mapping with its keys sorted at all levels, as PyYAML writes it.

    Args:
        item: mapping to sort. Any other value is returned unchanged.
        done: sorted mappings by the identity of the original mapping, so that each anchor is sorted
            once.
    """
    if not item.is_mapping:
        return item
    if (made := done.get(id(item))) is not None:
        return made
    try:
        keys: list[Any] = sorted(cast(Any, item.fields))  # keys of different types raise
    except TypeError:
        keys = list(item.fields)
    fields = {key: _sorted(item.fields[key], done) for key in keys}
    made = done[id(item)] = Item(fields, item.place, item.text, item.keys)
    return made
