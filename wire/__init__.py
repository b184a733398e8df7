"""What is on the wire, and nothing else: bytes to values and back."""
