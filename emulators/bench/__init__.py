"""A running emulator and what can be done to it: operator, faults, requests, transcript."""
