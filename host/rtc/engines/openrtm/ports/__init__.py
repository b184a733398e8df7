"""Ports as peers see them: PortService, data by CDR both ways, services; what peers are told."""
