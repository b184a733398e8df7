"""System Definitions and what they are read from (NEDO report, Fig. 108); nothing runs here."""
