"""The five end-to-end localizers: ``registry`` builds them by name, ``names`` needs no torch."""
