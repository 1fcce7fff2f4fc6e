"""Claims of the paper's text, and whether this run bears them out, by rules fixed in code."""
