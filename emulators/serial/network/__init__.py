"""A serial line served over TCP, plain or by RFC 2217, to hosts that cannot open a pty here."""
