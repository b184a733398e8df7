"""Data types of RT components: the structs of the IDL files, and their CDR bytes."""
