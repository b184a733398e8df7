"""Copies of our slave, each with one defect: they judge the tester."""
