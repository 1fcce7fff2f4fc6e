"""Runs of the workflow: jobs, results, predictions kept and restored."""
