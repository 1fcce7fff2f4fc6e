"""What a run costs before it is started, from the measurements of one that was run."""
