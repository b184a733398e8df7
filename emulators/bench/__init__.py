"""Control of a running emulator: operator, faults, requests, transcript."""
