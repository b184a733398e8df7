"""SDO frames put together to transfers, as a third party hears them."""
