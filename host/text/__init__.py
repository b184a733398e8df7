"""What people write and read: times, sizes, values, files of their own, traces; no commands."""
