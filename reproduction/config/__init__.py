"""Profiles: their model, reading, documentation."""
