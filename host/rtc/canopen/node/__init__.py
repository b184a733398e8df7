"""One node as the server sees it: boot-up, life cycle, operations, supervision."""
