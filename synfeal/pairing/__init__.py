"""Pairs of frames that see the same surfaces, and flow between them: from depth and poses."""
