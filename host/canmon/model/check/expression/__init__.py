"""Rules of `canmon check` as filter expressions with time: what is demanded of which frames."""
