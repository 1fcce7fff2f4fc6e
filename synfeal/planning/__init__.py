"""Planning of camera poses: one module per part of section 3 of the paper."""
