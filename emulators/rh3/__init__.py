"""The base of Reference Hardware 3 on a pty or in virtual time: `rh3-emu`."""
