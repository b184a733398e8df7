"""A log sent again: what is due when, and how late it went out."""
