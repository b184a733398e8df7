"""Widgets that the screens of host tools share (extra `tui`)."""
