"""What sensors on serial lines say: SCIP of range finders, the lines of a ucode reader."""
