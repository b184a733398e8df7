"""CANopen on the wire: values and codes of CiA 301 and CiA 305."""
