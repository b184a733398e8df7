"""The table of a resolution service: ucodes, their addresses, what is there."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from tickrig.host.rtc.ucode.contents_interpretation import parse_contents
from tickrig.host.text.names import near
from tickrig.host.text.toml_reader import load_toml
from tickrig.wire.ucode import parse_ucode

EXAMPLE: Final = """\
[ucodes]                                # 32 hex digits = a name below, or "http://..."
00001C00000000000001000000000001 = "door"
00001C00000000000001000000000002 = "lift"

[contents.door]                         # x_m and y_m in metres; all else are properties
x_m = 1.0
y_m = 0.0
name = "door of room 1"

[contents.lift]
x_m = 4.0
y_m = 2.5
name = "lift"
floor = 2
"""


@dataclass(frozen=True, slots=True)
class UcodeTable:
    """What a service knows.

    Attributes:
        ucodes: what each stands for: a name of `contents`, or an address.
        contents: JSON texts by name.
    """

    ucodes: Mapping[str, str] = field(default_factory=dict)
    contents: Mapping[str, str] = field(default_factory=dict)


def parse_table(text: str) -> UcodeTable:
    """Read a table.

    Raises:
        ValueError: it is none; the text is one line.

    >>> sorted(parse_table(EXAMPLE).contents)
    ['door', 'lift']
    """
    found = load_toml(text)
    if unknown := [name for name in found if name not in ("ucodes", "contents")]:
        raise ValueError(f"no section {unknown[0]!r}; {near(unknown[0], ['ucodes', 'contents'])}")
    contents = {name: _contents(name, each) for name, each in _tables(found, "contents").items()}
    ucodes = {
        parse_ucode(ucode): _target(ucode, target, contents)
        for ucode, target in _tables(found, "ucodes").items()
    }
    return UcodeTable(ucodes, contents)


def _tables(found: Mapping[str, Any], name: str) -> Mapping[str, object]:
    section = found.get(name, {})
    if not isinstance(section, dict):
        raise ValueError(f"[{name}] is a section, not {section!r}")
    return section


def _contents(name: str, found: object) -> str:
    if not (name.isascii() and name.replace("-", "").replace("_", "").isalnum()):
        raise ValueError(f"contents {name!r}: a name has letters, digits, - and _")
    try:
        text = json.dumps(found)
        parse_contents(text)
    except (TypeError, ValueError) as error:
        raise ValueError(f"contents {name!r}: {error}") from None
    return text


def _target(ucode: str, target: object, contents: Mapping[str, str]) -> str:
    if isinstance(target, str) and (target in contents or target.startswith("http://")):
        return target
    hint = near(str(target), list(contents))
    raise ValueError(f"ucode {ucode}: {target!r} is no name of contents and no http://...; {hint}")
