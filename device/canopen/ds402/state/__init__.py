"""The finite state automaton of a drive, its faults and what makes them (CiA 402-2)."""
