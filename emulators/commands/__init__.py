"""The command `tickrig` and what the command lines of all emulators share."""
