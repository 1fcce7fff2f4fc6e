"""Synfeal: a data-driven simulator for end-to-end camera localization.

From one textured 3D mesh to a 7-Scenes data set with exact poses; see ``docs/architecture.md``.
"""

__version__ = "0.1.0"
