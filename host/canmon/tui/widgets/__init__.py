"""Small things on the screen that know no tab."""
