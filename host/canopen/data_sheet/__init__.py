"""EDS files: checking by rules, fixing, comparing and showing."""
