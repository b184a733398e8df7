"""Engines: RT components as those of another middleware see them, each with an extra of its own."""
