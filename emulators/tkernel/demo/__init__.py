"""The demonstration `tickrig demo tkernel`: a robot keeps its position through an outage."""
