"""Effects of the camera and a changing world on ideal frames: light, movement, exposure, noise."""
