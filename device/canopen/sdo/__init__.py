"""SDO servers of a slave (CiA 301); their frames are in wire/canopen/sdo."""
