"""What the server takes from an EDS, which the canopen library reads."""

from __future__ import annotations

import configparser
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import canopen
from canopen.objectdictionary import ODVariable

from tickrig.host.rtc_canopen.errors import DefinitionError

IDENTITY: Final = ((0x1000, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3))
"""Device type, vendor-ID, product code, revision number; the serial number is of one device."""

RPDOS: Final = range(0x1400, 0x1600)
TPDOS: Final = range(0x1800, 0x1A00)


@dataclass(frozen=True, slots=True)
class DeviceFile:
    """A kind of device.

    Attributes:
        identity: values of `IDENTITY` that the file gives.
        data_types: data type by index and sub-index.
        pdos: communication parameters that it has.
    """

    identity: Mapping[tuple[int, int], int]
    data_types: Mapping[tuple[int, int], int]
    pdos: tuple[int, ...]


def read_device_file(path: Path) -> DeviceFile:
    """Read an EDS or DCF.

    Raises:
        DefinitionError: it cannot be read.
    """
    dictionary = _import(path)
    variables = {(var.index, var.subindex): var for var in _variables(dictionary)}
    return DeviceFile(
        {
            key: value
            for key in IDENTITY
            if key in variables and isinstance(value := variables[key].default, int)
        },
        {key: var.data_type for key, var in variables.items() if var.data_type is not None},
        tuple(index for index in dictionary if index in RPDOS or index in TPDOS),
    )


def _import(path: Path) -> canopen.ObjectDictionary:
    if path.suffix.lower() not in (".eds", ".dcf"):
        raise DefinitionError(f"{path}: the name does not end in .eds or .dcf")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # its own
            return canopen.import_od(str(path))
    except OSError as error:
        raise DefinitionError(f"{path}: {error.strerror}") from error
    except (configparser.Error, ValueError, KeyError, TypeError, AttributeError) as error:
        raise DefinitionError(f"{path} is no EDS: {' '.join(str(error).split())}") from error


def _variables(dictionary: canopen.ObjectDictionary) -> Iterator[ODVariable]:
    for item in dictionary.values():
        if isinstance(item, ODVariable):
            yield item
        else:
            yield from item.values()
