"""Commissioning of a CANopen network: find, address, configure and program its nodes."""
