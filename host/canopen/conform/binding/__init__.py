"""Binding of checks to one node: its objects, PDOs and features."""
