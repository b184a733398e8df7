"""`python -m tickrig` is the command `tickrig`."""

from tickrig.commands import tickrig

if __name__ == "__main__":
    tickrig()
