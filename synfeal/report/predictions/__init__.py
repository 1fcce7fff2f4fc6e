"""Predictions of a run in one file: tables can be made from it, and a run goes on from it."""
