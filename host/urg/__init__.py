"""A host's side of scanning range finders that speak SCIP 2.0."""
