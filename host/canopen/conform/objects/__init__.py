"""The checks that are made for every object of an EDS, and the steps that only they have."""
