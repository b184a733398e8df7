"""Names of ports and component types: what a PIC has room for."""

from __future__ import annotations

from typing import Final

from tickrig.wire.errors import FieldError

MAX_NAME_BYTES: Final = 15


def encode_name(name: str) -> bytes:
    """Write a name of 1 to 15 printable ASCII characters without blanks (DECISION L6).

    Raises:
        FieldError: it is empty, too long, or has other characters.
    """
    if not 1 <= len(name) <= MAX_NAME_BYTES:
        raise FieldError(f"name {name!r} has {len(name)} characters, 1..{MAX_NAME_BYTES} fit")
    if not all("!" <= character <= "~" for character in name):
        raise FieldError(f"name {name!r} is not printable ASCII without blanks")
    return name.encode("ascii")
