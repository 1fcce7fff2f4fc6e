"""The report: tables, figures and summary from result files; it computes nothing upstream.

Throughout, ``root`` is the results directory of a profile, ``design`` its design, and ``out_…`` are
files to write, whole or not at all. What a person can fix (a result file that is missing or cannot
be used, a profile or a tree that is none) ends in an :class:`~synfeal.errors.InputError` that names
it and says what to do.
"""
