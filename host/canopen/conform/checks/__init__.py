"""The checks as data: a text file for each group (notation: docs/reference/canopen/conform.md)."""
