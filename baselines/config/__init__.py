"""Typed configuration of label methods, localizers and references."""
