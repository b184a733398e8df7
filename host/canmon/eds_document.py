"""EDS files that verbs are given."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig.host.cli.refused import Refused, refuse_path

if TYPE_CHECKING:
    from pathlib import Path

    from tickrig.host.canopen.data_sheet.document import Document

LOOKED_AT = 4096
"""Characters at its beginning by which a binary file is known."""


def read_document(path: Path, what: str = "FILE") -> Document:
    """Read a file; Refused if it cannot be read, is too large or binary.

    Args:
        path: of the file.
        what: the argument or option that names it.
    """
    from tickrig.host.canopen.data_sheet.document import Document  # noqa: PLC0415 - slow
    from tickrig.host.canopen.eds import read_eds_bytes  # noqa: PLC0415 - slow
    from tickrig.wire.canopen.eds.eds_file import EdsError  # noqa: PLC0415 - slow

    try:
        data = read_eds_bytes(path)
    except OSError as error:
        refuse_path(what, error)
    except EdsError as error:
        raise Refused(f"{what} {error}") from None
    except ValueError as error:
        raise Refused(f"{what} {path}: {error}") from None
    if _is_binary(data):
        raise Refused(f"{what} {path}: a binary file: no EDS")
    return Document(str(path), data)


def _is_binary(data: bytes) -> bool:
    """Say whether more than each twentieth character is one that no text has."""
    from tickrig.wire.canopen.eds.eds_file import decode_text  # noqa: PLC0415 - slow

    head = decode_text(data[:LOOKED_AT])
    return sum(letter < " " and letter not in "\t\r\n" for letter in head) * 20 > len(head)


def read_device_document(path: Path, what: str = "FILE") -> Document:
    """Read a file that has to describe a device; Refused if it does not."""
    document = read_document(path, what)
    if not document.rows:
        raise Refused(f"{what} " + "\n".join(map(str, document.file.errors)))
    return document
