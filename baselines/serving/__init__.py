"""A place served over HTTP: photographs in, poses out."""
