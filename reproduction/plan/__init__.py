"""Prediction of what a run costs, from measurements of finished runs."""
