"""Requests and their answers, with one JSON object per line (docs/reference/bench/control.md)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Final, NoReturn

VERSION: Final = 1

Object = dict[str, object]
"""A JSON object."""

_Verb = tuple[Callable[[Object], Object], tuple[str, ...]]
"""Function that handles a request, and the fields of the request."""

_COMMON_FIELDS: Final = ("v", "do", "id")
_NOT_JSON: Final = "the line is not a JSON object"


class RequestDispatcher:
    """Dispatcher that calls a function for each request to a control socket, and makes the answer.

    An invalid request is refused and changes nothing.

    Args:
        verbs: function for each verb, which is the value of `do` in a request. A function raises
            ValueError to refuse a request.
    """

    def __init__(self, verbs: Mapping[str, _Verb]) -> None:
        self._verbs = verbs

    def answer_line(self, line: bytes) -> bytes:
        """Answer a received line."""
        try:
            request = json.loads(line.decode(), parse_constant=_refuse_constant)
            if not isinstance(request, dict):
                return refusal_line(_NOT_JSON)
            return _encode(self.answer(request))
        except UnicodeDecodeError as error:
            byte = line[error.start]
            return refusal_line(f"the line is not UTF-8: byte {error.start} is {byte:02x}h")
        except (ValueError, RecursionError) as error:
            return refusal_line(f"{_NOT_JSON}: {error}")

    def answer(self, request: Object) -> Object:
        """Execute a request. The answer has the key `ok`, and either the result or an `error`."""
        head: Object = {"id": request["id"]} if _is_id(request.get("id")) else {}
        try:
            return {"v": VERSION, **head, "ok": True, **self._dispatch(request)}
        except ValueError as error:
            return {**_refusal(str(error)), **head}

    def _dispatch(self, request: Object) -> Object:
        version = request.get("v")
        if type(version) is not int or version != VERSION:
            raise ValueError(f"version {short(version)} of the request is not {VERSION}")
        if "id" in request and not _is_id(request["id"]):
            raise ValueError(f"id is a whole number or a string, not {short(request['id'])}")
        do = request.get("do")
        if not isinstance(do, str) or do not in self._verbs:
            raise ValueError(f"no request {short(do)}; known: {', '.join(self._verbs)}")
        verb, fields = self._verbs[do]
        if unknown := [key for key in request if key not in (*_COMMON_FIELDS, *fields)]:
            known = ", ".join(fields) or "none"
            raise ValueError(f"{do} has no field {short(unknown[0])}; fields: {known}")
        return verb(request)


def _refusal(error: str) -> Object:
    """Return the answer to a refused request."""
    return {"v": VERSION, "ok": False, "error": error}


def refusal_line(error: str) -> bytes:
    """Return the line that answers a refused request."""
    return _encode(_refusal(error))


def text_of(request: Mapping[str, object], key: str) -> str:
    """Return a field of a request. Raise ValueError if it is not a string."""
    value = request.get(key)
    if not isinstance(value, str):
        raise ValueError(f"{key} is a string, not {short(value)}")
    return value


def whole(value: object, key: str, low: int, high: int) -> int:
    """Return an integer of a request, after checking its type and range.

    Args:
        value: value in the request.
        key: key of the value in the request. The error message contains the key.
        low: lowest allowed value.
        high: highest allowed value.

    Raises:
        ValueError: the value is not a whole number, or is out of range.
    """
    if not isinstance(value, int) or isinstance(value, bool):
        raise ValueError(f"{key} is a whole number, not {short(value)}")
    if not low <= value <= high:
        raise ValueError(f"{key} {short(value)} is not in {low}..{high}")
    return value


def short(value: object) -> str:
    """Return a received value as JSON, truncated to a readable length."""
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:60]}..."


def _is_id(value: object) -> bool:
    return isinstance(value, int | str) and not isinstance(value, bool)


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"JSON has no {name}")


def _encode(answer: Object) -> bytes:
    try:
        text = json.dumps(answer, allow_nan=False)
    except ValueError:
        text = json.dumps(_spelt(answer))
    return text.encode() + b"\n"


def _spelt(value: object) -> object:
    """Return a value with text in place of numbers that JSON does not have."""
    if isinstance(value, dict):
        return {key: _spelt(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_spelt(each) for each in value]
    return str(value) if isinstance(value, float) and not isfinite(value) else value
