"""Runs of the workflow: jobs and results."""
