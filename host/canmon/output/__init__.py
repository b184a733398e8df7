"""How verbs print, paint, send and end; not what a frame means."""
