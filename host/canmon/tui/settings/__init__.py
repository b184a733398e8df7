"""What a workspace keeps of each tab, checked."""
