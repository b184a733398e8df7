"""The control socket, both ends (docs/control.md), and the clock that serves it meanwhile."""
