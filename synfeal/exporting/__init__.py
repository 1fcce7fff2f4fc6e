"""A data set in the formats other programs read."""
