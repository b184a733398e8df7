"""The bus.yml of Lely's dcfgen and ros2_canopen: its slaves and its master."""
