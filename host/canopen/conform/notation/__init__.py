"""How checks are written down: lines of text, and names in place of numbers."""
