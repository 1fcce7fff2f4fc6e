"""How fast frames are rendered and written, and how far they are from 64 samples per pixel."""
