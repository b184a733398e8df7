"""SDO frames, their CRC and abort codes (CiA 301); transfers are put together elsewhere."""
