"""RRC messages: commands to the wheelchair relay, its replies and events."""
