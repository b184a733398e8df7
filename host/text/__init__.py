"""Text formats of users: times, sizes, values, files, traces."""
