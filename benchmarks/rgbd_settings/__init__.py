"""Settings of RGB-D odometry: what each costs, and how far the poses are off."""
