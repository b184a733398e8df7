"""CANopen slaves according to CiA 301 and CiA 305: one class for each service."""
