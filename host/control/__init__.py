"""The control socket, both ends, and its clock in real time (docs/reference/bench/control.md)."""
