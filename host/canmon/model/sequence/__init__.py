"""Sequences: frames to send and frames to expect, step by step, told the time."""
