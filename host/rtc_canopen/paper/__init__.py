"""What can be told of a System Definition from its files alone: checks, pictures; no bus."""
