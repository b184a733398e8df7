"""The experiments of the paper as a demonstration: a chain through two devices, and a power cut."""
