"""Components that drive robots through the proxies of their drives."""
