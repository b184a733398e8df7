"""Bodies of mobile robots: what turning wheels do to them."""
