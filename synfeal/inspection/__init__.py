"""First look at a mesh: its numbers, a picture, and a page to turn it around in."""
