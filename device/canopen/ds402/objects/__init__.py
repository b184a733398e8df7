"""The objects of a drive as numbers and settings (CiA 402-2), and its physical side."""
