"""Rendering with OpenGL on EGL: a GPU where there is one, Mesa's software renderer elsewhere.

Figures below are from Mesa's llvmpipe, processor time of one 640x480 view of a room of 203,000
faces and 16-megapixel textures; see ``results/benchmarks/rendering.md``.
"""
