"""Meshes: loading, checking, saving, decimation, ray queries."""
