"""Runs recorded and replayed: wire logs, traces, candump files."""
