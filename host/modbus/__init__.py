"""A Modbus RTU master over a link."""
