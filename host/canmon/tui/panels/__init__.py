"""The tabs of `canmon tui`, one module each, and the contract that they keep."""
