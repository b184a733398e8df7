"""The table of ports and topics in TOML. All errors are reported at once.

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
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from tickrig.host.rtc.engines.ros2 import topic_entry
from tickrig.host.rtc.engines.ros2.conversions import MESSAGES
from tickrig.host.text.names import near
from tickrig.host.text.section import (
    Field,
    Schema,
    Section,
    anything,
    flag,
    is_broken,
    matching,
    read_section,
    shown,
    string,
)
from tickrig.host.text.toml_reader import Mistake
from tickrig.host.text.values import parse_time_with_unit_us

_TOPIC: Final = re.compile(r"/?[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_PORT: Final = re.compile(r"[^\s.]+\.[^\s.]+")


def _is_topic(word: str) -> bool:
    return _TOPIC.fullmatch(word) is not None and "__" not in word


def _time(value: object) -> int:
    return parse_time_with_unit_us(str(value))


def _message(value: object) -> str:
    if isinstance(value, str) and value in MESSAGES:
        return value
    raise ValueError(f"{shown(value)} is no known message; {near(str(value), MESSAGES)}")


def _period(value: object) -> int:
    if 10_000 <= (period_us := _time(value)) <= 3_600_000_000:
        return period_us
    raise ValueError(f"it takes 10ms..3600s, not {shown(value)}")


def _joints(value: object) -> tuple[str, ...]:
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return tuple(value)
    raise ValueError(f"it takes a list of names, not {shown(value)}")


_USUAL: Final = "that of its type"
_OF_TYPES: Final = {
    "frame": tuple(topic_entry.FRAMES),
    "child_frame": topic_entry.PLACED,
    "joints": ("sensor_msgs/msg/JointState",),
}
"""Keys that only some messages have."""
_TOP: Final[Schema] = {
    "topic": Field(anything, "tables [[topic]]", "a port and its topic", "none"),
    "diagnostics": Field(anything, "a table", "topic and period of the states", "as usual"),
}
_ENTRY: Final[Schema] = {
    "port": Field(matching(_PORT.fullmatch, "a port, as Odometry0.out"), "COMPONENT.PORT", "which"),
    "topic": Field(matching(_is_topic, "a topic, as cmd_vel"), "a topic, as cmd_vel", "its name"),
    "type": Field(_message, "a message, as std_msgs/msg/Int32", "of its values"),
    "frame": Field(string, "a frame", "of its header", _USUAL),
    "child_frame": Field(string, "a frame", "of what moves", _USUAL),
    "joints": Field(_joints, "a list of names", "of the values", "none"),
    "stop_after": Field(_time, "a time", "silence after which a command ends", _USUAL),
    "reliable": Field(flag, "true, false", "whether lost samples are sent again", "true"),
}
_DIAGNOSTICS: Final[Schema] = {
    "topic": Field(
        matching(lambda w: not w or _is_topic(w), "a topic, as diagnostics, or empty for none"),
        *("a topic", "of the states", "diagnostics"),
    ),
    "period": Field(_period, "10ms..3600s", "how often they are sent", "1s"),
}


def parse_table(text: str, name: str) -> topic_entry.TopicTable:
    """Parse the table that assigns ports of components to ROS 2 topics.

    Args:
        text: text of the whole file.
        name: name of the file for messages.

    Raises:
        ValueError: the table is invalid. The message has a line for each mistake, with file and
            line number.
    """
    top = read_section(text)
    top.read(_TOP)
    made = [entry for each in top.tables("topic") if (entry := _entry(each, name)) is not None]
    _check_once(top, made)
    words = section.read(_DIAGNOSTICS) if (section := top.sub("diagnostics")) else {}
    if mistakes := top.notes.all:
        raise ValueError("\n".join(f"{name}:{line}: {reason}" for line, reason in mistakes))
    usual = topic_entry.TopicTable()
    topic = words.get("topic", usual.diagnostics).lstrip("/")
    return topic_entry.TopicTable(tuple(made), topic, words.get("period", usual.period_us))


def _entry(section: Section, file: str) -> topic_entry.TopicEntry | None:
    """Return the entry of a table, or None if the table is wrong."""
    before = len(section.notes.mistakes)
    words = section.read(_ENTRY)
    kind = words.get("type")
    for key, kinds in _OF_TYPES.items():
        if kind and key in section.values and kind not in kinds:
            section.wrong(f"{kind} has no {key}; it is for {', '.join(kinds)}", key)
    if len(section.notes.mistakes) > before or is_broken(section.values):
        return None
    usual = topic_entry.usual_entry(words["port"], words["topic"].lstrip("/"), words["type"])
    given = {_FIELDS.get(key, key): words[key] for key in (*_OF_TYPES, *_FIELDS) if key in words}
    line = section.notes.document.line_of(section.keys)
    return replace(usual, reliable=words.get("reliable", True), place=f"{file}:{line}", **given)


_FIELDS: Final = {"stop_after": "stop_after_us"}


def _check_once(top: Section, entries: Iterable[topic_entry.TopicEntry]) -> None:
    """Report a pair of port and topic that occurs twice, and a topic with two types."""
    pairs: dict[tuple[str, str], topic_entry.TopicEntry] = {}
    kinds: dict[str, topic_entry.TopicEntry] = {}
    for entry in entries:
        line = int(entry.place.rpartition(":")[2])
        if first := pairs.get((entry.port, entry.topic)):
            text = f"{entry.port} has the topic {entry.topic} already, see {first.place}"
            top.notes.mistakes.append(Mistake(line, text))
        elif (other := kinds.get(entry.topic)) and other.type != entry.type:
            text = f"{entry.topic} has the type {other.type} already, see {other.place}"
            top.notes.mistakes.append(Mistake(line, text))
        pairs[entry.port, entry.topic] = kinds[entry.topic] = entry
