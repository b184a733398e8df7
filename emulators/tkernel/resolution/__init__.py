"""The resolution service of ucodes: a table, its faults, HTTP: `ucode-resolver`."""
