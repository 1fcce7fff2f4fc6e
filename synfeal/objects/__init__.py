"""Objects placed in scenes, and the painted patches they are made of."""
