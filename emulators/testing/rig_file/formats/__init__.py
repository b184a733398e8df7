"""Files that are no rig files and say what is on a bench, put into the words of one."""
