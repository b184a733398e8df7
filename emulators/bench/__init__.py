"""A running emulator and what can be done to it: operator, wire log, requests, process."""
