"""Devices put onto buses and ptys: rig, clocks, wires, faults, command lines."""
