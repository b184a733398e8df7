"""The table of a resolution service: ucodes, their addresses, and contents."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tickrig.host.rtc.ucode.contents_interpretation import parse_contents
from tickrig.host.text.names import near
from tickrig.host.text.section import (
    Field,
    Schema,
    Section,
    anything,
    in_a_line,
    is_broken,
    read_section,
)
from tickrig.wire.ucode import parse_ucode

EXAMPLE: Final = Path(__file__).with_name("example.toml").read_text("utf-8")


@dataclass(frozen=True, slots=True)
class UcodeTable:
    """Table of a ucode resolution service: where the information of each ucode is.

    Attributes:
        ucodes: targets by ucode. The target is a name of `contents`, or an address.
        contents: information as JSON texts, by name.
    """

    ucodes: Mapping[str, str] = field(default_factory=dict)
    contents: Mapping[str, str] = field(default_factory=dict)


_SECTIONS: Final[Schema] = {
    "ucodes": Field(anything, "a table", "what each ucode stands for", "none"),
    "contents": Field(anything, "a table", "what is there", "none"),
}


def parse_table(text: str) -> UcodeTable:
    """Parse the TOML text of a table of ucodes for a resolution service.

    Raises:
        ValueError: the table is invalid. The message is one line.

    >>> sorted(parse_table(EXAMPLE).contents)
    ['door', 'lift']
    """
    top = read_section(text)
    top.read(_SECTIONS)
    contents = dict(_taken(top.sub("contents"), _contents))
    targets = _taken(top.sub("ucodes"), lambda ucode, target: _target(ucode, target, contents))
    ucodes = {parse_ucode(ucode): target for ucode, target in targets}
    if mistakes := top.notes.all:
        raise ValueError(in_a_line(mistakes))
    return UcodeTable(ucodes, contents)


def _taken(
    section: Section | None, take: Callable[[str, object], str]
) -> Iterator[tuple[str, str]]:
    """Yield the keys of a section with their values; report invalid keys and values."""
    if section is None:
        return
    for key, value in section.values.items():
        try:
            if not is_broken(value):
                yield key, take(key, value)
        except ValueError as error:
            section.wrong(str(error), key)


def _contents(name: str, found: object) -> str:
    if not (name.isascii() and name.replace("-", "").replace("_", "").isalnum()):
        raise ValueError("a name has letters, digits, - and _")
    try:
        text = json.dumps(found)
    except TypeError as error:
        raise ValueError(str(error)) from None
    parse_contents(text)
    return text


def _target(ucode: str, target: object, contents: Mapping[str, str]) -> str:
    parse_ucode(ucode)
    if isinstance(target, str) and (target in contents or target.startswith("http://")):
        return target
    hint = near(str(target), list(contents))
    raise ValueError(f"{target!r} is no name of contents and no http://...; {hint}")
