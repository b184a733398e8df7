"""pyserial hosts on a line in virtual time; the handler package of `tickrig://`."""
