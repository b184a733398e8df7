"""The control socket, both ends (docs/control.md); not what can be asked."""
