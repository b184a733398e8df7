"""What is counted of a bus frame by frame: rates, gaps, bits, load."""
