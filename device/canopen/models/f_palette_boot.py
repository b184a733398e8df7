"""The I/O module f-palette with a boot loader: its program is downloaded over the bus (CiA 302-3).

The document of the module describes no boot loader. This model exists to test downloads.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.models import f_palette
from tickrig.device.canopen.parameter_store import BootLoader, add_program_objects
from tickrig.device.canopen.slave import CanopenSlave, Nonvolatile
from tickrig.device.canopen.stack import make_slave

NODE_ID: Final = 17
PROGRAM: Final = b"f-palette"
"""The program that runs until another program is downloaded."""


class BootableModule(Ds401):
    """The I/O module, whose inputs and outputs belong to its program."""

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot, inputs=(f_palette.ADC,) * f_palette.ANALOGUE_INPUTS)
        self.boot_loader = BootLoader(node, PROGRAM)

    def power_on(self) -> None:
        """Start the program, if there is one."""
        super().power_on()
        self.boot_loader.power_on()


def make_f_palette_boot(
    node_id: int = NODE_ID, nonvolatile: Nonvolatile | None = None
) -> CanopenSlave:
    """Make the module, with the arguments and errors of `make_f_palette`."""
    slave = make_slave(dictionary(), node_id, nonvolatile, make_application)
    slave.model = "f-palette-boot"
    return slave


def dictionary() -> Dictionary:
    """Return the objects of one slave with default values; slaves share the description."""
    return _template().copy()


@cache
def _template() -> Dictionary:
    profile = replace(f_palette.PROFILE, name="f-palette-boot", product_code=2)
    objects = f_palette.object_table(profile)
    add_program_objects(objects)
    return Dictionary(objects, objects.objects)


def make_application(node: CanopenSlave, slot: int) -> BootableModule:
    """Make the application, for `make_slave`."""
    return BootableModule(node, slot)
