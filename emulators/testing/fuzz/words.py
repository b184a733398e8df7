"""What a device is told, as a user writes it."""

from __future__ import annotations

Word = bytes | str
"""Bytes of a serial line, or a frame in candump's notation."""


def check_words(name: str, words: object, on_can: bool) -> None:
    """Look whether words are a list of what a device of this wire hears.

    Args:
        name: what they are called.
        words: as a user has given them.
        on_can: whether the device is on a CAN bus.

    Raises:
        ValueError: they are not.
    """
    if isinstance(words, str | bytes) or not isinstance(words, list | tuple):
        example = "'705#7F'" if on_can else "b'ON\\\\n'"
        raise ValueError(f"{name}: a list, as [{example}], got {words!r:.60}")
    for word in words:
        if not isinstance(word, str | bytes):
            raise ValueError(f"{name}: bytes, or a frame as '705#7F', got {word!r:.60}")
        if isinstance(word, str) is not on_can:
            wanted = "on CAN: a frame as '705#7F'" if on_can else "on a line: bytes"
            raise ValueError(f"{name}: this device is {wanted}, got {word!r:.60}")
