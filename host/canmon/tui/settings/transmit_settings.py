"""A row of the transmit list in a workspace.

>>> read_row({"send": "080#", "every": "10ms"}).every
'10ms'
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tickrig.host.canmon.tui.settings.nested_settings import texts_of
from tickrig.host.canmon.tui.settings.settings import text_of
from tickrig.host.monitor.transmit.transmit_words import TransmitWords


def read_row(settings: Mapping[str, Any]) -> TransmitWords:
    """Return what a row says; SettingError if a setting is none."""
    return TransmitWords(
        text_of(settings, "send", ""),
        text_of(settings, "every", ""),
        texts_of(settings, "counter"),
        texts_of(settings, "checksum"),
        text_of(settings, "name", ""),
    )


def row_settings(words: TransmitWords) -> dict[str, Any]:
    """Return it as settings; what is empty is None, so that a workspace leaves it out."""
    return {
        "send": words.frame,
        "every": words.every or None,
        "counter": list(words.counters) or None,
        "checksum": list(words.checksums) or None,
        "name": words.name or None,
    }
