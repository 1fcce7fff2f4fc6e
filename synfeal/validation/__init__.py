"""Is a data set what it says it is? Files, poses, splits, manifest, and geometry."""
