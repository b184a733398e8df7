"""The RRC's serial protocol: LF-terminated ASCII lines (RRC manual, 30 April 2015)."""
