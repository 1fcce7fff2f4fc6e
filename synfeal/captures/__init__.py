"""Captures of a place as devices and programs write them, behind one object.

:func:`synfeal.captures.formats.read_capture` finds out which format a folder or file is in and
returns a :class:`synfeal.captures.capture.Capture`; :mod:`synfeal.captures.unpack` writes one as a
posed sequence that ``scan``, ``map`` and ``collect --like`` read.
"""
