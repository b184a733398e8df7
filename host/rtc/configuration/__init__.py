"""Configuration sets, parameters and their constraints (OMG SDO)."""
