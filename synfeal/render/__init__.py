"""Rendering: one small interface, one module per backend."""

from synfeal.render.choose import open_renderer

__all__ = ["open_renderer"]
