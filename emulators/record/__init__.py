"""Recording, replay and comparison of runs: wire logs, traces, candump files."""
