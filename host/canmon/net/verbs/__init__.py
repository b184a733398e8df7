"""One module for each verb of `canmon net`, or two that belong together."""
