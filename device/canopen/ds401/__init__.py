"""CiA 401: generic I/O modules."""

from tickrig.device.canopen.ds401.analogue import Converter
from tickrig.device.canopen.ds401.module import Ds401

__all__ = ["Converter", "Ds401"]
