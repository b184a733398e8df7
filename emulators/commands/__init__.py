"""The command `tickrig`, and common parts of the command lines of all emulators."""
