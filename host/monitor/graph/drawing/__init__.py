"""Curves drawn: braille, SVG, PNG, HTML, CSV."""
