"""How hard a scene is for localisation: features, repetition, and what SfM and SLAM make of it.

``python -m benchmarks.scene_difficulty --help`` says how to run it; ``docs/scenes.md`` what the
tables mean.
"""
