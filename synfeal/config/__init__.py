"""Typed configuration of what data sets are made of."""
