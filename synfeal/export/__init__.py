"""A data set in the formats other programs read: COLMAP, Nerfstudio, TUM RGB-D."""
