"""EDS files held against rules, mended, compared and shown."""
