"""The motion components of Reference Hardware 3: from a goal to turning wheels."""
