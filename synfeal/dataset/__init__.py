"""Data sets on disk: 7-Scenes directories, packed frames, tables of poses."""
