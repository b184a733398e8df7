"""Requests to something that runs, and their answers: one JSON object a line (docs/control.md)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Final

VERSION: Final = 1

Object = dict[str, object]
"""A JSON object."""

Verb = tuple[Callable[[Object], Object], tuple[str, ...]]
"""What answers a request, and the fields that it takes."""

COMMON_FIELDS: Final = ("v", "do", "id")
NOT_JSON: Final = "the line is not a JSON object"


class Requests:
    """Answers requests by a table of verbs; a bad request changes nothing.

    Args:
        verbs: by what a request has in `do`. A verb raises ValueError to refuse.
    """

    def __init__(self, verbs: Mapping[str, Verb]) -> None:
        self._verbs = verbs

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
            raise ValueError(f"version {short(request.get('v'))} of the request is not {VERSION}")
        do = request.get("do")
        if not isinstance(do, str) or do not in self._verbs:
            raise ValueError(f"no request {short(do)}; known: {', '.join(self._verbs)}")
        verb, fields = self._verbs[do]
        if unknown := [key for key in request if key not in (*COMMON_FIELDS, *fields)]:
            known = ", ".join(fields) or "none"
            raise ValueError(f"{do} has no field {short(unknown[0])}; fields: {known}")
        return verb(request)


def refusal(error: str) -> Object:
    """Return the answer to a request that cannot be done."""
    return {"v": VERSION, "ok": False, "error": error}


def refusal_line(error: str) -> bytes:
    """Return that answer as a line."""
    return json.dumps(refusal(error)).encode() + b"\n"


def text_of(request: Mapping[str, object], key: str) -> str:
    """Return a field that is a string; ValueError if it is none."""
    value = request.get(key)
    if not isinstance(value, str):
        raise ValueError(f"{key} is a string, not {short(value)}")
    return value


def whole(value: object, key: str) -> int:
    """Return a whole number; ValueError if it is none."""
    if not isinstance(value, int) or isinstance(value, bool):
        raise ValueError(f"{key} is a whole number, not {short(value)}")
    return value


def short(value: object) -> str:
    """Show what came, as JSON, cut to a sensible length."""
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:60]}..."
