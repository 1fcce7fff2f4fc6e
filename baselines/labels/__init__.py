"""Section 4.1: poses re-estimated from images, in batches, with assistance."""
