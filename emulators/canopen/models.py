"""Built-in device models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from tickrig.device.canopen.device_rtc import CanopenEcho, application_of, make_dictionary
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.models import epos, f_palette, f_palette_boot, motor_core_unit
from tickrig.device.canopen.slave import ServiceMaker
from tickrig.emulators.canopen.eds import DeviceDescription
from tickrig.wire.canopen.eds.object_table import BIT_RATES, DeviceInfo

_VENDOR: Final = "tickrig"
_PRODUCT: Final = 0x1008


@dataclass(frozen=True, slots=True)
class EmulatedModel:
    """A built-in CANopen device, such as `epos`, which can be emulated without an EDS file.

    Attributes:
        name: name of the model on command lines and in rig files.
        text: description as readable text.
        node_id: default node-ID of the model.
        dictionary: function that makes the objects with default values.
        application: factory of the application.
    """

    name: str
    text: str
    node_id: int
    dictionary: Callable[[], Dictionary]
    application: ServiceMaker

    def describe(self) -> DeviceDescription:
        """Return the description of the model, including properties that an EDS cannot express."""
        template = self.dictionary()
        return DeviceDescription(
            self.name,
            DeviceInfo(_VENDOR, template[_PRODUCT, 0].data.decode("ascii"), bit_rates=BIT_RATES),
            template,
            self.node_id,
            application=self.application,
        )


_MODELS: Final = (
    EmulatedModel(
        "f-palette",
        "I/O module: 8 digital inputs, 8 digital outputs, 8 analogue inputs",
        f_palette.NODE_ID,
        f_palette.dictionary,
        f_palette.make_application,
    ),
    EmulatedModel(
        "f-palette-boot",
        "f-palette with a boot loader that takes its program (1F50h)",
        f_palette_boot.NODE_ID,
        f_palette_boot.dictionary,
        f_palette_boot.make_application,
    ),
    EmulatedModel(
        "motor-core-unit",
        "motor core unit with FTMD driver: current, velocity and angle mode",
        motor_core_unit.NODE_ID,
        motor_core_unit.dictionary,
        motor_core_unit.make_application,
    ),
    EmulatedModel(
        "epos",
        "CiA 402 drive as Maxon's EPOS 24/5, at a wheel of the robot beego",
        epos.NODE_ID,
        epos.dictionary,
        epos.make_application,
    ),
    EmulatedModel(
        "rtc-echo",
        "DeviceRTC whose out-port repeats the value of its in-port, both Long",
        48,
        partial(make_dictionary, CanopenEcho),
        application_of(CanopenEcho),
    ),
)

MODELS: Final = {model.name: model for model in _MODELS}
"""Models by name."""
