"""What checks stand on at one node: the objects and PDOs that their names mean, its features."""
