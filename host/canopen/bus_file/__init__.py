"""The bus.yml of Lely's dcfgen and ros2_canopen: which slaves and which master it means."""
