"""Tests of the emulated RRC."""
