"""Log files of CAN buses: candump, JSON lines, and what python-can reads and writes."""
