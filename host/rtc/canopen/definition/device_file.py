"""What the server takes from an EDS."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tickrig.host.canopen.eds import read_sound
from tickrig.host.rtc.canopen.errors import DefinitionError
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_file import EdsError, Finding

IDENTITY: Final = ((0x1000, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3))
"""Device type, vendor-ID, product code, revision number; the serial number is of one device."""

ENDINGS: Final = (".eds", ".dcf", ".xdd", ".xdc")
RPDOS: Final = range(0x1400, 0x1600)
TPDOS: Final = range(0x1800, 0x1A00)


@dataclass(frozen=True, slots=True)
class DeviceFile:
    """A kind of device.

    Attributes:
        identity: values of `IDENTITY` that the file gives.
        defaults: bytes of the power-on values that it gives; a node-ID is not added.
        data_types: data type by index and sub-index.
        pdos: communication parameters that it has.
        relative: those of `defaults` to which a device adds its node-ID.
        findings: what is wrong in the file, whose objects are then not used.
    """

    identity: Mapping[tuple[int, int], int]
    data_types: Mapping[tuple[int, int], int]
    pdos: tuple[int, ...]
    defaults: Mapping[tuple[int, int], bytes]
    relative: frozenset[tuple[int, int]] = frozenset()
    findings: tuple[Finding, ...] = ()


def read_device_file(path: Path) -> DeviceFile:
    """Read an EDS, DCF, XDD or XDC.

    Raises:
        DefinitionError: it cannot be read.
    """
    device, findings = _read(path)
    defaults = {
        (row.index, row.sub): row.default
        for row in device.entries
        if row.has_default and row.data_type.is_integer
    }
    return DeviceFile(
        {key: int.from_bytes(defaults[key], "little") for key in IDENTITY if key in defaults},
        {(row.index, row.sub): row.data_type for row in device.entries},
        tuple(index for index in device.objects if index in RPDOS or index in TPDOS),
        defaults,
        frozenset((row.index, row.sub) for row in device.entries if row.relative),
        findings,
    )


def _read(path: Path) -> tuple[EdsDevice, tuple[Finding, ...]]:
    if path.suffix.lower() not in ENDINGS:
        raise DefinitionError(f"{path}: the name does not end in {', '.join(ENDINGS)}")
    try:
        return read_sound(path)
    except OSError as error:
        raise DefinitionError(f"{path}: {error.strerror}") from error
    except EdsError as error:
        raise DefinitionError(str(error)) from error
