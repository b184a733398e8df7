"""Modbus RTU (Modbus Application Protocol 1.1b3; Modbus over Serial Line 1.02)."""
