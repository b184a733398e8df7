"""Execution contexts: when components run, and in which order (OMG RTC 1.0)."""
