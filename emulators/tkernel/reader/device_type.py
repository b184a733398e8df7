"""The ucode reader as a device type: `ucode-reader-emu`, and its configuration in traces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from tickrig.device.ucode_reader import Marker, ReaderParameters, UcodeReader
from tickrig.emulators.commands.device_type import ConfiguredDevice, DeviceType, check_config
from tickrig.emulators.fields import named
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.tkernel.reader.fields import FIELDS
from tickrig.host.text.trace import Config, Mark
from tickrig.wire.ucode import BAUD, parse_ucode


def _config_to_trace(parameters: ReaderParameters, markers: Sequence[Marker]) -> Config:
    """Return all parameters and the markers."""
    return {
        "range_m": parameters.range_m,
        "cone_deg": parameters.cone_deg,
        "markers": " ".join(f"{marker.ucode},{marker.x_m},{marker.y_m}" for marker in markers),
    }


def build_reader(config: Config) -> UcodeReader:
    """Make an emulated ucode reader from its configuration.

    Raises:
        ValueError: a setting is unknown, or its value is invalid.
    """
    defaults = _config_to_trace(ReaderParameters(), ())
    check_config(config, defaults, "a reader has no setting", typed=False)
    settings: dict[str, Any] = {**defaults, **config}
    range_m, cone_deg = settings["range_m"], settings["cone_deg"]
    if type(range_m) not in (int, float) or type(cone_deg) is not int:
        raise ValueError(f"range_m {range_m!r} and cone_deg {cone_deg!r} are not two numbers")
    parameters = ReaderParameters(range_m=range_m, cone_deg=cone_deg)
    return UcodeReader(parameters, tuple(map(_parse_marker, str(settings["markers"]).split())))


def _parse_marker(text: str) -> Marker:
    """Read `UCODE,X,Y`; raise ValueError if the text is not a marker.

    >>> _parse_marker("00001c00000000000001000000000001,1,-0.5").y_m
    -0.5
    """
    ucode, *places = text.split(",")
    try:
        x_m, y_m = map(float, places)
    except ValueError:
        raise ValueError(f"a marker is UCODE,X,Y in m, got {text!r}") from None
    return Marker(parse_ucode(ucode), x_m, y_m)


def _configure(reader: DeviceType, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
    parameters = ReaderParameters(range_m=options["range_m"], cone_deg=options["cone_deg"])
    with named("--marker"):
        markers = tuple(map(_parse_marker, options["markers"]))
    config = _config_to_trace(parameters, markers)
    return ConfiguredDevice(reader, UcodeReader(parameters, markers), config)


UCODE_READER: Final = DeviceType(
    name="ucode-reader",
    title="ucode reader",
    build=build_reader,
    fields=FIELDS,
    configure=_configure,
    config_of=lambda reader: _config_to_trace(reader.parameters, reader.markers),
    line=LineSettings(baud=BAUD),
    is_event=lambda line: line.mark is Mark.TO_DEVICE,
)
