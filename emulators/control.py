"""Requests to a running emulator and their answers: one JSON object a line (docs/control.md)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Final

from tickrig.emulators.byte_text import escape
from tickrig.emulators.emulated import look_at
from tickrig.emulators.fault_spec import parse_fault_spec
from tickrig.emulators.names import known
from tickrig.emulators.operator import PRESS_US
from tickrig.emulators.workbench import Workbench
from tickrig.host.cli.setting import Setting

VERSION: Final = 1

Object = dict[str, object]
"""A JSON object."""

COMMON_FIELDS: Final = ("v", "do", "id")
MAX_LINES: Final = 100
NOT_JSON: Final = "the line is not a JSON object"


class Control:
    """Answers requests about one emulator; a bad request changes nothing.

    Args:
        emulator: what is controlled. It must not be stepping meanwhile.
    """

    def __init__(self, emulator: Workbench) -> None:
        self._emulator = emulator
        self._verbs: dict[str, tuple[Callable[[Object], Object], tuple[str, ...]]] = {
            "describe": (self._describe, ()),
            "get": (self._get, ("names",)),
            "set": (self._set, ("name", "value")),
            "press": (self._press, ("name", "duration_us")),
            "fault": (self._fault, ("spec",)),
            "clear": (self._clear, ("name",)),
            "lines": (self._lines, ("since",)),
            "status": (self._status, ()),
            "stop": (self._stop, ()),
        }

    def answer_line(self, line: bytes) -> bytes:
        """Answer a line as it came from the wire."""
        try:
            request = json.loads(line)
            if not isinstance(request, dict):
                return refusal_line(NOT_JSON)
            return json.dumps(self.answer(request)).encode() + b"\n"
        except (ValueError, RecursionError) as error:
            return refusal_line(f"{NOT_JSON}: {error}")

    def answer(self, request: Object) -> Object:
        """Answer a request: `ok`, and what was asked for or `error`."""
        head: Object = {"id": request["id"]} if isinstance(request.get("id"), int | str) else {}
        try:
            return {"v": VERSION, **head, "ok": True, **self._dispatch(request)}
        except ValueError as error:
            return {**refusal(str(error)), **head}

    def _dispatch(self, request: Object) -> Object:
        if request.get("v") != VERSION:
            raise ValueError(f"version {_short(request.get('v'))} of the request is not {VERSION}")
        do = request.get("do")
        if not isinstance(do, str) or do not in self._verbs:
            raise ValueError(f"no request {_short(do)}; known: {', '.join(self._verbs)}")
        verb, fields = self._verbs[do]
        if unknown := [key for key in request if key not in (*COMMON_FIELDS, *fields)]:
            known = ", ".join(fields) or "none"
            raise ValueError(f"{do} has no field {_short(unknown[0])}; fields: {known}")
        return verb(request)

    def _describe(self, request: Object) -> Object:
        emulator, device = self._emulator, self._emulator.device
        return {
            "device": emulator.name,
            "tick_us": device.tick_us,
            "inputs": [
                {
                    **{"name": item.name, "text": item.text, "kind": item.kind.value},
                    **{"low": item.low, "high": item.high, "unit": item.unit},
                }
                for item in device.inputs.table.values()
            ],
            "groups": {name: list(members) for name, members in device.inputs.groups.items()},
            "outputs": [
                {"name": item.name, "text": item.text, "unit": item.unit}
                for item in device.outputs.values()
            ],
            "wire_faults": [
                {"name": name, "text": kind.text, "rated": kind.rated}
                for name, kind in emulator.wire.kinds.items()
            ],
        }

    def _get(self, request: Object) -> Object:
        device = self._emulator.device
        names = request.get("names", [*device.inputs.table, *device.outputs])
        if not isinstance(names, list):
            raise ValueError(f"names is a list of names, not {_short(names)}")
        for name in names:
            if not isinstance(name, str) or not (
                name in device.inputs.table or name in device.outputs
            ):
                everything = known([*device.inputs.table, *device.outputs])
                raise ValueError(f"no input or output {_short(name)}; known: {everything}")
        return {"values": {name: look_at(device, name) for name in names}}

    def _set(self, request: Object) -> Object:
        name, value = _text(request, "name"), request.get("value")
        values = value if isinstance(value, list) else [value]
        self._emulator.operator.set(name, *[_setting(item) for item in values])
        return {}

    def _press(self, request: Object) -> Object:
        duration_us = _whole(request.get("duration_us", PRESS_US), "duration_us")
        emulator = self._emulator
        emulator.operator.press(emulator.touch_us, _text(request, "name"), duration_us)
        return {}

    def _fault(self, request: Object) -> Object:
        emulator = self._emulator
        emulator.operator.fault(emulator.touch_us, parse_fault_spec(_text(request, "spec")))
        return {}

    def _clear(self, request: Object) -> Object:
        self._emulator.operator.clear(_text(request, "name"))
        return {}

    def _lines(self, request: Object) -> Object:
        since = _whole(request.get("since", 0), "since")
        return {
            "lines": [
                {"number": x.number, "at_us": x.at_us, "mark": x.mark, "text": escape(x.data)}
                for x in self._emulator.log.since(since)[-MAX_LINES:]
            ]
        }

    def _status(self, request: Object) -> Object:
        return dict(self._emulator.status())

    def _stop(self, request: Object) -> Object:
        self._emulator.stop()
        return {}


def refusal(error: str) -> Object:
    """Return the answer to a request that cannot be done."""
    return {"v": VERSION, "ok": False, "error": error}


def refusal_line(error: str) -> bytes:
    """Return that answer as a line."""
    return json.dumps(refusal(error)).encode() + b"\n"


def _text(request: Mapping[str, object], key: str) -> str:
    value = request.get(key)
    if not isinstance(value, str):
        raise ValueError(f"{key} is a string, not {_short(value)}")
    return value


def _whole(value: object, key: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise ValueError(f"{key} is a whole number, not {_short(value)}")
    return value


def _setting(value: object) -> Setting:
    if not isinstance(value, int | float | str) or isinstance(value, bool):
        raise ValueError(f"value is a number or a string, not {_short(value)}")
    return value


def _short(value: object) -> str:
    """Show what came, as JSON, cut to a sensible length."""
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:60]}..."
