"""A data set of a person's own mesh: planned, rendered, written and checked in one command."""
