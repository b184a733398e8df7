"""A scanning range finder on a pty or in virtual time: `urg-emu`."""
