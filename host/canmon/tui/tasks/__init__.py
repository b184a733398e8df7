"""What goes on behind the tabs: sources, rules, sequences, SDO; nothing is painted here."""
