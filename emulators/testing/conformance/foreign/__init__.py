"""Slaves of other stacks in virtual time: LocalNode of the canopen library, durand."""
