"""CANopen codecs: values and codes of CiA 301 and CiA 305."""
