"""What a person sees of a run of the workflow while it is under way."""
