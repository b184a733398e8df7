"""EDS files that verbs are given."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig._lazy import LazyModule
from tickrig.host.cli.messages import Refused, refuse_path

if TYPE_CHECKING:
    from pathlib import Path

    from tickrig.host.canopen import eds
    from tickrig.host.canopen.bus_file import bus_file
    from tickrig.host.canopen.data_sheet import document as documents
    from tickrig.wire.canopen.eds import eds_file

else:  # slow
    bus_file = LazyModule("tickrig.host.canopen.bus_file.bus_file")
    documents = LazyModule("tickrig.host.canopen.data_sheet.document")
    eds = LazyModule("tickrig.host.canopen.eds")
    eds_file = LazyModule("tickrig.wire.canopen.eds.eds_file")

_YAML_ENDINGS = (".yml", ".yaml")
_LOOKED_AT = 4096
"""Characters at its beginning by which a binary file is known."""


def read_document(path: Path, what: str = "FILE", encoding: str = "") -> documents.Document:
    """Read a file; Refused if it cannot be read, is too large or binary, or is a bus.yml.

    Args:
        path: of the file.
        what: the argument or option that names it.
        encoding: of the file, by its name in Python; empty for that which its bytes show.
    """
    try:
        data = eds.read_eds_bytes(path)
    except OSError as error:
        refuse_path(what, error)
    except eds_file.EdsError as error:
        raise Refused(f"{what} {error}") from None
    except ValueError as error:
        raise Refused(f"{what} {path}: {error}") from None
    if _is_binary(data):
        raise Refused(f"{what} {path}: a binary file: no EDS")
    is_other = b"[" not in data[:_LOOKED_AT] or path.suffix.lower() in _YAML_ENDINGS
    if is_other and (other := bus_file.check_of(data, path)):
        raise Refused(f"{what} {path}: no EDS, but {other}")
    if path.suffix.lower() == ".toml":
        raise Refused(f"{what} {path}: TOML, not an EDS; for a rig file use: tickrig check {path}")
    return documents.Document(str(path), data, encoding)


def _is_binary(data: bytes) -> bool:
    """Say whether more than each twentieth character is one that no text has."""
    head = eds_file.decode_text(data[:_LOOKED_AT])
    return sum(letter < " " and letter not in "\t\r\n" for letter in head) * 20 > len(head)


def read_device_document(path: Path, what: str = "FILE") -> documents.Document:
    """Read a file that has to describe a device; Refused if it does not."""
    document = read_document(path, what)
    if not document.rows:
        raise Refused(f"{what} " + "\n".join(map(str, document.file.errors)))
    return document
