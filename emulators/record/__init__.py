"""Runs recorded, replayed and compared: wire logs, traces, candump files."""
