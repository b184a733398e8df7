"""Real devices at their ports, with an operator who does what no program can."""
