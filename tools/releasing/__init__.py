"""What tools/release is made of: the changelog, the builds, and what is looked at in them."""
