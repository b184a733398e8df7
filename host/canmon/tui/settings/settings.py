"""Settings of a panel, checked one by one.

>>> truth({"bits": True}, "bits", False), choice({}, "time", "z", ["z", "d"])
(True, 'z')
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
