"""Settings inside settings: arrays of tables, lists of texts.

>>> texts_of({"counter": ["0:0..3"]}, "counter"), texts_of({}, "counter")
(('0:0..3',), ())
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from tickrig.host.canmon.workspace import SettingError


def tables(settings: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    """Return an array of tables, empty if it is not there; SettingError if it is none."""
    value = settings.get(name, [])
    if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
        raise SettingError((name,), f"is no array of tables [[{name}]]")
    return value


def texts_of(settings: Mapping[str, Any], name: str) -> tuple[str, ...]:
    """Return a list of texts, empty if it is not there; SettingError if it is none."""
    value = settings.get(name, [])
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise SettingError((name,), f"{value!r} is no list of texts")
    return tuple(value)


@contextmanager
def below(*path: str | int) -> Iterator[None]:
    """Let what is wrong with a setting inside be told with the whole path to it.

    Any other ValueError is told of the path itself.
    """
    try:
        yield
    except SettingError as error:
        reason = str(error).partition(": ")[2]
        raise SettingError((*path, *error.path), reason) from None
    except ValueError as error:
        raise SettingError(path, str(error)) from None
