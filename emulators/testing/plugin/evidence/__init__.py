"""What a test leaves behind: what is told after a failure, what is kept, what is compared."""
