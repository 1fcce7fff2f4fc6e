"""Settings of structure from motion: what each costs, and how far the poses are off."""
