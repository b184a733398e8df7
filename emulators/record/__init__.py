"""Runs recorded and replayed: traces, candump logs, transcripts."""
