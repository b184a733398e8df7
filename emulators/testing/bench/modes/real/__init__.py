"""Real time: hosts at ptys and buses of this machine, and a rig in a thread of its own."""
