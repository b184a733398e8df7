"""What people write and read: times, sizes, values, files of their own, log lines; no commands."""
