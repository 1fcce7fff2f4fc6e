"""Places: one folder from a capture to what localizes photographs in it."""
