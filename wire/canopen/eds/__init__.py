"""EDS and DCF files (CiA 306) and the objects they describe; no dictionary that lives."""
