"""Localizers, label methods, label errors and reference methods, found by their declarations."""
