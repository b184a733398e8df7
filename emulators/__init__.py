"""Devices put onto buses and ptys: rig, clocks, wires, faults, command lines."""

import logging

logging.getLogger("tickrig").addHandler(logging.NullHandler())  # a library is silent
