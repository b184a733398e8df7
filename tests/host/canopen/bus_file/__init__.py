"""Tests of the reader of bus.yml."""
