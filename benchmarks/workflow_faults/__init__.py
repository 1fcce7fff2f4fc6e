"""Faults of the whole workflow: kills, full disks, too little memory, and what is the same twice.

``python -m benchmarks.workflow_faults --help`` says how to run it; ``docs/robustness.md`` what the
tables mean.
"""
