"""Sequences that are kept, as texts.

>>> sequence_name('name = "start"', 1), sequence_name("# sync" + chr(10) + "+10 080#", 2)
('start', 'sync')
>>> sequence_name("", 3)
'sequence 3'
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from tickrig.host.canmon.tui.settings.nested_settings import below, tables
from tickrig.host.canmon.tui.settings.settings import text_of

NEW: Final = """\
name = "new"

[[step]]
send = "080#"

[[step]]
wait = "100ms"
"""
"""What a new sequence begins with."""

_NAME: Final = re.compile(r"""\s*(?:name\s*=\s*["'](.+?)["']|#\s*(.+?))\s*""")


def sequence_name(text: str, number: int) -> str:
    """Return what a sequence is called: by its name, or a comment on its first line."""
    match = _NAME.fullmatch(text.partition("\n")[0])
    return (match[1] or match[2]) if match else f"sequence {number}"


def read_texts(settings: Mapping[str, Any]) -> list[str]:
    """Return the texts of `[[item]]`; SettingError if one is none."""
    texts = []
    for number, item in enumerate(tables(settings, "item")):
        with below("item", number):
            texts.append(text_of(item, "text", ""))
    return texts


def texts_settings(texts: list[str]) -> list[dict[str, Any]]:
    """Return them as settings, each over as many lines as it has."""
    import tomlkit  # noqa: PLC0415 - an extra
    from tomlkit.exceptions import InvalidStringError  # noqa: PLC0415

    def written(text: str) -> Any:
        text = text.lstrip("\n")  # TOML drops the first one
        try:
            return tomlkit.string(text, literal=True, multiline=True)
        except InvalidStringError:
            return text

    return [{"text": written(text)} for text in texts]
