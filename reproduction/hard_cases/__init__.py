"""Where textbook formulas lose their digits: ours beside them, both against exact answers."""
