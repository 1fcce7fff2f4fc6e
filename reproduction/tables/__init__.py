"""Every table of the paper, and those beside them."""
