"""EDS, DCF and XDD files (CiA 306, CiA 311), and the objects they describe."""
