"""Measurements of speed, beside the errors they buy."""
