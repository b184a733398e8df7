"""Settings of a panel in a workspace, checked one by one.

>>> truth({"bits": True}, "bits", False), choice({}, "time", "z", ["z", "d"])
(True, 'z')

>>> texts_of({"counter": ["0:0..3"]}, "counter"), texts_of({}, "counter")
(('0:0..3',), ())
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from tickrig.host.canmon.workspace import SettingError


def truth(settings: Mapping[str, Any], name: str, default: bool) -> bool:
    """Return what is true or false; SettingError if it is neither."""
    value = settings.get(name, default)
    if not isinstance(value, bool):
        raise SettingError((name,), f"{value!r} is neither true nor false")
    return value


def text_of(settings: Mapping[str, Any], name: str, default: str) -> str:
    """Return a text; SettingError if it is none."""
    value = settings.get(name, default)
    if not isinstance(value, str):
        raise SettingError((name,), f"{value!r} is no text")
    return value


def choice(settings: Mapping[str, Any], name: str, default: str, known: Sequence[str]) -> str:
    """Return one of some texts; SettingError if it is none of them."""
    value = settings.get(name, default)
    if value not in known:
        raise SettingError((name,), f"{value!r} is none of {', '.join(known)}")
    return str(value)


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


def checked_bus(buses: Collection[str], settings: Mapping[str, Any]) -> str:
    """Return the bus that settings name, empty for the first; SettingError if it is not there.

    A log has no buses: then any name may stand there.
    """
    bus = text_of(settings, "bus", "")
    if bus and buses and bus not in buses:
        raise SettingError(("bus",), f"{bus!r} is none of {', '.join(buses)}")
    return bus
