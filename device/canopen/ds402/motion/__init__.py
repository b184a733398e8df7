"""The axis of a drive: references, profiles, limits, switches, units; no mode of operation."""
