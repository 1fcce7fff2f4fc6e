"""Limits by resampling."""
