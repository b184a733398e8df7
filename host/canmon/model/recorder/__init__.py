"""Recording in parts: rotation, limits of disk space, what came before a trigger, an index."""
