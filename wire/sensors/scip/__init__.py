"""SCIP 2.0, the text protocol of scanning range finders (Hokuyo, C-42-03320B), and SCIP 1.1."""
