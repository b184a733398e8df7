"""Curves of signals: cut out of frames, decimated, and drawn as braille, SVG, HTML, PNG or CSV."""
