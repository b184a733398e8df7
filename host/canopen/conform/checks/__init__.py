"""The checks as data: a text file for each group, in the notation of docs/conform.md."""
