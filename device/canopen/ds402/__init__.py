"""Drives (CiA 402-2)."""

from tickrig.device.canopen.ds402.drive import Ds402

__all__ = ["Ds402"]
