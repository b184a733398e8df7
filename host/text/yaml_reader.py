"""YAML as a tree with line numbers, limited to texts, numbers and flags.

>>> tree, wrong = read_yaml("a: 0x10", "bus.yml")
>>> tree.value["a"].value, str(tree.value["a"].place), wrong
(16, 'bus.yml:1', ())
"""

from __future__ import annotations

import datetime
import re
from functools import lru_cache
from typing import Final

import yaml

from tickrig.host.text.document import FileMistake, FilePlace, Item, Key, Scalar
from tickrig.wire.canopen.eds.eds_file import shorten

_WIDEST: Final = 1_000
"""Maximum number of bits of a number. A longer number remains a text."""
_DIGITS: Final = frozenset("0123456789.")
_MERGE: Final = "tag:yaml.org,2002:merge"


_READ_APART: Final = (
    (
        "[-+]?0[0-7_]+",
        "{!r} is octal for PyYAML, and for yaml-cpp in whole numbers; decimal in others",
    ),
    ("[-+]?0[0-9]*[89][0-9]*", "{!r} is a text for PyYAML, and no whole number for yaml-cpp"),
    (
        "[-+]?[0-9][0-9_]*(?::[0-5]?[0-9])+(?:[.][0-9_]*)?",
        "{!r} is base 60 for PyYAML, no number for yaml-cpp",
    ),
    ("[-+]?0b[01_]+", "{!r} is binary for PyYAML, no number for yaml-cpp"),
    ("[-+]?(?:0x)?[0-9][0-9a-fA-F.]*_[0-9a-fA-F_.]*", "{!r} has _, which only PyYAML passes over"),
    (
        "[-+]?(?:[0-9]+[.]?[0-9]*|[.][0-9]+)[eE][0-9]+",
        "{!r} is a text for PyYAML, a number for yaml-cpp",
    ),
    ("[-+]?[0-9]+[eE][-+][0-9]+", "{!r} is a text for PyYAML, a number for yaml-cpp"),
)
"""Numbers that dcfgen (PyYAML, YAML 1.1) and ros2_canopen (yaml-cpp) read differently."""

_LONGEST: Final = 120
_MEANT: Final = {
    "found character '\\t'": "a tab; indent with spaces",
    "expected <block end>": "it is indented otherwise than the lines before",
    "mapping values are not allowed": "a colon too many, or none in the line before",
    "could not find expected ':'": "no colon with a space behind it, here or in the line before",
    "cannot start any token": "{}; put it into quotes",
}
"""Meanings of PyYAML's messages, by the start of the message."""


def read_yaml(text: str, name: str) -> tuple[Item | None, tuple[FileMistake, ...]]:
    """Parse a YAML text to a tree of items with line numbers.

    Args:
        text: content of the whole file.
        name: name of the file, for error messages.

    Returns:
        The tree and all errors, as a pair. The tree is None if the text is empty or cannot be
        parsed.
    """
    try:
        root = _composed(text)
        if root is None:
            return None, (FileMistake(FilePlace(name, 1), "the file is empty", "yaml"),)
        tree = _Tree(name)
        return tree.item(root), tuple(tree.wrong)
    except yaml.reader.ReaderError as error:
        line, reason = text.count("\n", 0, error.position) + 1, "a character that no text has"
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, reason = mark.line + 1 if mark else 1, _said(str(error.problem or error.context))
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        line, reason = 1, str(error)
    except RecursionError:
        line, reason = 1, "lists or mappings nest too deep"
    return None, (FileMistake(FilePlace(name, line), f"not YAML: {_in_a_line(reason)}", "yaml"),)


@lru_cache(maxsize=4)  # PyYAML takes ten times as long as all that is made of its nodes
def _composed(text: str) -> yaml.Node | None:
    return yaml.compose(text, yaml.SafeLoader)


def _said(problem: str) -> str:
    """Return a message of PyYAML in helpful words."""
    for words, meant in _MEANT.items():
        if words in problem:
            return meant.format(problem)
    return problem


def _in_a_line(reason: str) -> str:
    """Return a printable reason."""
    text = "".join(letter if letter.isprintable() else "?" for letter in " ".join(reason.split()))
    return text[:_LONGEST]


class _Tree:
    """A factory that makes items from nodes.

    The item of an anchored node is made only once, so that nested anchors in a file cannot exhaust
    the memory.
    """

    def __init__(self, name: str) -> None:
        self.wrong: list[FileMistake] = []
        self._name = name
        self._plain = yaml.constructor.SafeConstructor()
        self._done: dict[int, Item] = {}
        self._open: set[int] = set()

    def item(self, node: yaml.Node) -> Item:
        """Make an item from a node."""
        key = id(node)
        if (done := self._done.get(key)) is not None:
            return done
        place = self._place(node)
        if key in self._open:
            self._wrong("yaml-loop", node, "it holds itself")
            return Item(None, place)
        self._open.add(key)
        item = self._make(node, place)
        self._open.discard(key)
        self._done[key] = item
        return item

    def _make(self, node: yaml.Node, place: FilePlace) -> Item:
        if isinstance(node, yaml.SequenceNode):
            return Item(tuple(map(self.item, node.value)), place)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, place)
        self._check_number(node)
        return Item(self._scalar(node), place, shorten(str(node.value)))

    def _mapping(self, node: yaml.MappingNode, place: FilePlace) -> Item:
        """Make a mapping from the items of `<<`, then its own items.

        The last duplicate key counts.
        """
        fields: dict[Key, Item] = {}
        keys: dict[Key, FilePlace] = {}
        own: list[tuple[yaml.Node, yaml.Node]] = []
        for key_node, value in node.value:
            if key_node.tag != _MERGE:
                own.append((key_node, value))
                continue
            for merged in self._merged(value):
                for key, each in merged.fields.items():
                    fields.setdefault(key, each)
                    keys.setdefault(key, merged.keys[key])
        seen: dict[Key, FilePlace] = {}
        for key_node, value in own:
            if not isinstance(key_node, yaml.ScalarNode):
                self._wrong("yaml-key", key_node, "a key is a text or a number, this is not")
                continue
            key = self._scalar(key_node)
            if key in seen:
                text = f"{shorten(str(key_node.value))!r} is there twice: {seen[key]}"
                self._wrong("yaml-twice", key_node, text)
            keys[key] = seen[key] = self._place(key_node)
            fields[key] = self.item(value)
        return Item(fields, place, keys=keys)

    def _merged(self, node: yaml.Node) -> list[Item]:
        """Return the mappings of `<<`."""
        nodes = node.value if isinstance(node, yaml.SequenceNode) else [node]
        items = [self.item(each) for each in nodes]
        for each, item in zip(nodes, items, strict=True):
            if not item.is_mapping:
                self._wrong("yaml-merge", each, "<< takes a mapping, or a list of some")
        return [item for item in items if item.is_mapping]

    def _check_number(self, node: yaml.Node) -> None:
        """Warn about a number that the two readers read differently. In quotes, it is a text."""
        text = str(node.value)
        if not isinstance(node, yaml.ScalarNode) or node.style is not None:
            return
        if len(text) <= _LONGEST and text.strip("-+")[:1] in _DIGITS:
            for form, said in _READ_APART:
                if re.fullmatch(form, text):
                    self._wrong("yaml-number", node, said.format(shorten(text)))
                    return

    def _scalar(self, node: yaml.Node) -> Scalar:
        """Return the value of a scalar in YAML 1.1. Dates remain texts."""
        try:
            value = self._plain.construct_object(node)
        except (yaml.YAMLError, ValueError, LookupError, AttributeError, TypeError, OverflowError):
            self._wrong("yaml-value", node, f"{shorten(str(node.value))!r} is no {node.tag}")
            return str(node.value)
        if isinstance(value, int) and value.bit_length() > _WIDEST:  # Python prints none so long
            return str(node.value)
        if isinstance(value, datetime.date | bytes):
            return str(node.value)
        return value if value is None or isinstance(value, str | int | float) else str(node.value)

    def _wrong(self, rule: str, node: yaml.Node, text: str) -> None:
        self.wrong.append(FileMistake(self._place(node), text, rule))

    def _place(self, node: yaml.Node) -> FilePlace:
        return FilePlace(self._name, node.start_mark.line + 1)
