"""The seam for engines, CORBA or DDS: ports joined with those of peers, calls of their threads."""
