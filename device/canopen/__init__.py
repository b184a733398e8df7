"""CANopen slaves after CiA 301 and CiA 305: one class a service."""
