"""Printing, screens, sending and ending of verbs, but not the meaning of frames."""
