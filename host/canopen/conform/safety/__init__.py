"""What may be done to the node, and how it is put back as it was."""
