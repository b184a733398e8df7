"""What a slave does about errors: EMCY, 1001h, 1003h, 1029h, its CAN controller (CiA 301)."""
