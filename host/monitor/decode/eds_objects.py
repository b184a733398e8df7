"""Names, types and power-on values out of an EDS or DCF, by the canopen library."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from tickrig.host.monitor.decode.decoded import EDS
from tickrig.host.monitor.decode.object_text import ObjectText, slug
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError

if TYPE_CHECKING:
    from canopen.objectdictionary import ObjectDictionary, ODVariable

Entry = tuple[int, int]


class EdsError(ValueError):
    """A file that is no EDS or DCF."""


@dataclass(frozen=True, slots=True)
class EdsObjects:
    """What a file says of a node.

    Attributes:
        texts: name, type and unit by index and sub-index.
        values: power-on values, as bytes on the wire, likewise.
        name: of the device, empty where the file has none.
    """

    texts: Mapping[Entry, ObjectText] = field(default_factory=dict)
    values: Mapping[Entry, bytes] = field(default_factory=dict)
    name: str = ""


def read_eds(path: Path, node_id: int) -> EdsObjects:
    """Read an EDS or DCF for a node.

    Raises:
        OSError: the file cannot be read.
        EdsError: it is malformed.
    """
    import configparser  # noqa: PLC0415 - for files alone

    from canopen.objectdictionary import import_od  # noqa: PLC0415 - slow

    file = io.StringIO(_read_text(path))
    file.name = "file.eds"  # by which the library tells formats
    try:
        found = import_od(file, node_id)
    except (configparser.Error, ValueError, KeyError, TypeError, AttributeError) as error:
        raise EdsError(f"{path} is no EDS: {' '.join(str(error).split())}") from error
    variables = list(_variables(found))
    if not variables:
        raise EdsError(f"{path} is no EDS: it has no objects")
    return EdsObjects(
        {(item.index, item.subindex): _text(name, item) for name, item in variables},
        {
            (item.index, item.subindex): data
            for _, item in variables
            if (data := _power_on(item)) is not None
        },
        found.device_information.product_name or path.stem,
    )


def _read_text(path: Path) -> str:
    """Return the text; vendors write Windows code pages, too."""
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _variables(found: ObjectDictionary) -> Iterator[tuple[str, ODVariable]]:
    """Yield each variable with its name."""
    for item in found.values():
        members = getattr(item, "subindices", None)
        if members is None:
            yield slug(item.name), item
            continue
        for member in members.values():
            yield f"{slug(item.name)}.{slug(member.name) or member.subindex}", member


def _text(name: str, item: ODVariable) -> ObjectText:
    return ObjectText(name, _kind(item), item.unit or "", item.factor, EDS)


def _kind(item: ODVariable) -> DataType | None:
    try:
        return DataType(item.data_type or 0)
    except ValueError:
        return None


def _power_on(item: ODVariable) -> bytes | None:
    """Return the bytes of a value; None where there is none, or the library lost it."""
    value = item.default if item.value is None else item.value
    kind = _kind(item)
    if kind is None or value is None or not kind.is_integer:
        return None
    try:
        return kind.encode(value)
    except FieldError as error:
        import logging  # noqa: PLC0415 - a verb on a small log starts without

        logging.getLogger(__name__).warning("%04Xh:%02X: %s", item.index, item.subindex, error)
        return None
