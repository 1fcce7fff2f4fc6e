"""What the text of the paper claims, and whether this run bears it out, by rules fixed in code."""
