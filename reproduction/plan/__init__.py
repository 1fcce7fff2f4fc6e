"""Cost of a run before it is started, from the measurements of one that was run."""
