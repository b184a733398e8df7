"""The common interfaces of mobile robots (IIS): their rules, and what joins their phases."""
