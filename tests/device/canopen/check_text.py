"""Conformance checks in the notation of their specification, one step a line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any, Final

Step = dict[str, Any]

WITHIN_MS: Final = 50
REFERENCE_ID: Final = re.compile(r"([A-Z0-9]+-\d+) (.+)")


def parse_checks(text: str) -> Iterator[dict[str, Any]]:
    """Read checks; they are parted by empty lines, and lines with # are comments."""
    for block in re.split(r"\n\s*\n", re.sub(r"^#.*\n", "", text, flags=re.MULTILINE).strip()):
        head, *lines = block.split("\n")
        match = REFERENCE_ID.fullmatch(head)
        assert match is not None, head
        needs = [word for line in lines if line.startswith("needs:") for word in line.split()[1:]]
        steps = [
            step for line in lines if not line.startswith("needs:") for step in parse_step(line)
        ]
        yield {"id": match[1], "title": match[2], "needs": needs, "steps": steps}


def parse_step(line: str) -> list[Step]:
    """Read a line: mostly one step, two for an SDO."""
    for pattern, make in _NOTATIONS:
        match = re.fullmatch(pattern, line)
        if match is not None:
            return make(*match.groups())
    raise ValueError(f"unknown step {line!r}")


def _expect(patterns: str, within_ms: str | None) -> list[Step]:
    return [{"expect": patterns.split(" or "), "in": int(within_ms or WITHIN_MS)}]


def _count(least: str, most: str, pattern: str, for_ms: str) -> list[Step]:
    return [{"count": pattern, "for": int(for_ms), "min": int(least), "max": int(most)}]


def _macro(name: str, index: str, rest: str) -> list[Step]:
    return [{"macro": [name, int(index, 16), *map(int, rest.split())]}]


def _write(index: str, sub: str, data: str) -> list[Step]:
    return [_download(index, sub, data), _response("60" + _at(index, sub), "")]


def _refuse(index: str, sub: str, data: str, codes: str) -> list[Step]:
    aborts = [
        f"585#80{_at(index, sub)}{bytes.fromhex(code)[::-1].hex().upper()}"
        for code in codes.split()
    ]
    return [_download(index, sub, data), {"expect": aborts, "in": WITHIN_MS}]


def _read(index: str, sub: str, data: str) -> list[Step]:
    request = {"send": f"605#40{_at(index, sub)}00000000"}
    return [request, _response(f"{_command(data, 0x43)}{_at(index, sub)}", data)]


def _download(index: str, sub: str, data: str) -> Step:
    return {"send": f"605#{_command(data, 0x23)}{_at(index, sub)}{data.ljust(8, '0')}"}


def _response(head: str, data: str) -> Step:
    filler = "." if data else "0"
    return {"expect": [f"585#{head}{data.ljust(8, filler)}"], "in": WITHIN_MS}


def _command(data: str, command: int) -> str:
    return f"{command | (4 - len(data) // 2) << 2:02X}"


def _at(index: str, sub: str) -> str:
    return f"{index[2:]}{index[:2]}{sub}"


_NOTATIONS: Final[tuple[tuple[str, Callable[..., list[Step]]], ...]] = (
    (r"> (\S+)", lambda frame: [{"send": frame}]),
    (r"< (.+?)(?: within (\d+) ms)?", _expect),
    (r"none on (\w+) for (\d+) ms", lambda cob_id, ms: [{"none": cob_id, "for": int(ms)}]),
    (r"wait (\d+) ms", lambda ms: [{"wait": int(ms)}]),
    (r"forget (\w+)", lambda cob_id: [{"drop": cob_id}]),
    (r"(\d+)\.\.(\d+) x (\S+) in (\d+) ms", _count),
    (r"power cycle", lambda: [{"power": True}]),
    (r"app: (.+)", lambda words: [{"app": words.split()}]),
    (r"macro (\w+) (\w{4})h (.+)", _macro),
    (r"write (\w{4}) (\w\w) (\w+)", _write),
    (r"refuse (\w{4}) (\w\w) (\w+) (.+)", _refuse),
    (r"read (\w{4}) (\w\w) ([\w.]+)", _read),
)
