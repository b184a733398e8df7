"""The monitor as a full-screen program (extra `tui`)."""
