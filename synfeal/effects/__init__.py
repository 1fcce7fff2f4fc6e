"""What a camera and a changing world add to ideal frames: light, movement, exposure, noise."""
