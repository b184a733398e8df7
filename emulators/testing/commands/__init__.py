"""tickrig run, check, init, record, compare."""
