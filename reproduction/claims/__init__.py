"""Claims of the paper's text, judged on a run by rules fixed in code."""
