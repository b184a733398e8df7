"""What is known of objects: by standard, by EDS, by what was heard."""
