"""The RRC, the Robotic Relay Communicator between a VR2 joystick and its power module."""
