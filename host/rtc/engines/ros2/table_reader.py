"""The table of ports and topics, in TOML: all that is wrong with it is told at once.

>>> text = '''
... [[topic]]
... port = "Odometry.OdometryPosition"
... topic = "odom"
... type = "nav_msgs/msg/Odometry"
... '''
>>> parse_table(text, "robot.toml").entries[0]
TopicEntry(port='Odometry.OdometryPosition', topic='odom', type='nav_msgs/msg/Odometry', \
frame='odom', child_frame='base_link', joints=(), stop_after_us=0, reliable=True, \
place='robot.toml:2')
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, Final

from tickrig.host.rtc.engines.ros2.conversions import MESSAGES
from tickrig.host.rtc.engines.ros2.topic_entry import (
    FRAMES,
    PLACED,
    TopicEntry,
    TopicTable,
    usual_entry,
)
from tickrig.host.text.toml_reader import BROKEN, TomlDocument, read_toml
from tickrig.host.text.values import parse_time_with_unit_us

_OF_TYPES: Final = {
    "frame": tuple(FRAMES),
    "child_frame": PLACED,
    "joints": ("sensor_msgs/msg/JointState",),
}
"""Keys that only some messages have."""

_KEYS: Final = ("port", "topic", "type", *_OF_TYPES, "stop_after", "reliable")

_TOPIC: Final = re.compile(r"/?[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_PORT: Final = re.compile(r"[^\s.]+\.[^\s.]+")


def parse_table(text: str, name: str) -> TopicTable:
    """Return what a file says.

    Args:
        text: the whole file.
        name: of the file, for messages.

    Raises:
        ValueError: what is wrong, a line for each mistake, with file and line.
    """
    return _Table(read_toml(text), name).read()


class _Table:
    """Reads one file, and collects what is wrong."""

    def __init__(self, document: TomlDocument, name: str) -> None:
        self._document, self._name = document, name
        self._mistakes = [(line, reason) for line, reason in document.mistakes]
        self._path: tuple[str | int, ...] = ()

    def read(self) -> TopicTable:
        values = self._document.values
        for key in values.keys() - {"topic", "diagnostics"}:
            self._wrong(f"unknown key {key!r}; known: topic, diagnostics", key)
        entries = self._list(values.get("topic", []))
        made = tuple(filter(None, map(self._entry, range(len(entries)), entries)))
        self._once(made)
        table = self._diagnostics(made, values.get("diagnostics", {}))
        if self._mistakes:
            lines = [f"{self._name}:{line}: {reason}" for line, reason in sorted(self._mistakes)]
            raise ValueError("\n".join(lines))
        return table

    def _wrong(self, reason: str, *keys: str | int) -> None:
        self._mistakes.append((self._document.line_of((*self._path, *keys)), reason))

    def _list(self, entries: Any) -> list[Any]:
        if isinstance(entries, list):
            return entries
        if entries is not BROKEN:
            self._wrong("topic is no list; an entry begins with [[topic]]", "topic")
        return []

    def _entry(self, number: int, words: Any) -> TopicEntry | None:
        self._path, before = ("topic", number), len(self._mistakes)
        if not isinstance(words, dict):
            self._wrong("an entry is a table with port, topic and type")
            return None
        for key in words.keys() - {*_KEYS}:
            self._wrong(f"unknown key {key!r}; known: {', '.join(_KEYS)}", key)
        kind = self._text(words, "type", MESSAGES.__contains__, f"one of {', '.join(MESSAGES)}")
        for key, kinds in _OF_TYPES.items():
            if kind and key in words and kind not in kinds:
                self._wrong(f"{kind} has no {key}; it is for {', '.join(kinds)}", key)
        port = self._text(words, "port", _PORT.fullmatch, "a port, as Odometry0.out")
        topic = self._text(words, "topic", _is_topic, "a topic, as cmd_vel").lstrip("/")
        usual = usual_entry(port, topic, kind)
        entry = replace(
            usual,
            frame=self._text(words, "frame", None, "a frame", usual.frame),
            child_frame=self._text(words, "child_frame", None, "a frame", usual.child_frame),
            joints=self._joints(words.get("joints", [])),
            stop_after_us=self._time(words, "stop_after", usual.stop_after_us),
            reliable=self._truth(words.get("reliable", True)),
            place=f"{self._name}:{self._document.line_of(self._path)}",
        )
        return entry if len(self._mistakes) == before else None

    def _text(
        self,
        words: dict[str, Any],
        key: str,
        is_one: Callable[[str], object] | None,
        wanted: str,
        default: str | None = None,
    ) -> str:
        value = words.get(key, default)
        if value is None:
            self._wrong(f"{key} is missing: {wanted}")
        elif not isinstance(value, str) or not (is_one is None or is_one(value)):
            if value is not BROKEN:
                self._wrong(f"{key} {value!r} is not {wanted}", key)
        else:
            return value
        return ""

    def _joints(self, names: Any) -> tuple[str, ...]:
        if isinstance(names, list) and all(isinstance(name, str) for name in names):
            return tuple(names)
        if names is not BROKEN:
            self._wrong(f"joints {names!r} is no list of names", "joints")
        return ()

    def _truth(self, value: Any) -> bool:
        if not isinstance(value, bool) and value is not BROKEN:
            self._wrong(f"reliable {value!r} is not true or false", "reliable")
        return value is True

    def _time(self, words: dict[str, Any], key: str, default_us: int) -> int:
        value = words.get(key)
        if value is None or value is BROKEN:
            return default_us
        try:
            return parse_time_with_unit_us(str(value))
        except ValueError as error:
            self._wrong(f"{key}: {error}", key)
            return default_us

    def _once(self, entries: Iterable[TopicEntry]) -> None:
        """Find a pair of port and topic that stands there twice, a topic with two types."""
        pairs: dict[tuple[str, str], TopicEntry] = {}
        kinds: dict[str, TopicEntry] = {}
        for entry in entries:
            line = int(entry.place.rpartition(":")[2])
            if first := pairs.get((entry.port, entry.topic)):
                text = f"{entry.port} has the topic {entry.topic} already, see {first.place}"
                self._mistakes.append((line, text))
            elif (other := kinds.get(entry.topic)) and other.type != entry.type:
                text = f"{entry.topic} has the type {other.type} already, see {other.place}"
                self._mistakes.append((line, text))
            pairs[entry.port, entry.topic] = kinds[entry.topic] = entry

    def _diagnostics(self, entries: tuple[TopicEntry, ...], words: Any) -> TopicTable:
        self._path = ("diagnostics",)
        if not isinstance(words, dict):
            if words is not BROKEN:
                self._wrong("diagnostics is a table with topic and period")
            return TopicTable(entries)
        for key in words.keys() - {"topic", "period"}:
            self._wrong(f"unknown key {key!r}; known: topic, period", key)
        wanted = "a topic, as diagnostics, or empty for none"
        topic = self._text(words, "topic", _is_topic_or_none, wanted, "diagnostics")
        period_us = self._time(words, "period", 1_000_000)
        if not 10_000 <= period_us <= 3_600_000_000:
            self._wrong(f"period {words['period']} is not in 10ms..3600s", "period")
        return TopicTable(entries, topic.lstrip("/"), period_us)


def _is_topic(text: str) -> bool:
    return _TOPIC.fullmatch(text) is not None and "__" not in text


def _is_topic_or_none(text: str) -> bool:
    return not text or _is_topic(text)
