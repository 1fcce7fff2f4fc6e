"""Cases in which textbook formulas lose their digits, with stored reference values."""
