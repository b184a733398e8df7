"""What the command lines of host tools and emulators share."""
