"""Sphinx's configuration: ``make docs``.

The source folder is the repository, so that pages link to each other and to files as they do
there; ``include_patterns`` picks the pages. The reference is written by ``reference.py``.
"""

import sys
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms.post_transforms import SphinxPostTransform

SITE = Path(__file__).parent
ROOT = SITE.parents[1]
sys.path[:0] = [str(SITE), str(ROOT)]

import reference  # noqa: E402

import synfeal  # noqa: E402

project = "Synfeal"
author = "The Synfeal reproducibility benchmark authors"
copyright = f"2026, {author}"  # noqa: A001
version = release = synfeal.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
]
root_doc = "docs/index"
include_patterns = [
    "docs/*.md",
    "docs/*.ipynb",
    "docs/paper/*.md",
    "docs/tutorials/*.ipynb",
    "docs/reference/**.rst",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "config/README.md",
    "config/scenes/README.md",
    "results/benchmarks/*.md",
]
# Folders that are not searched for pages; `.venv` alone has tens of thousands of files.
exclude_patterns = [".*", "build", "tests", "mutants", "results/[!b]*", "**/__pycache__"]
exclude_patterns += ["results/benchmarks/coverage.md"]  # a bare table without a title

myst_enable_extensions = ["colon_fence", "deflist", "linkify"]
myst_heading_anchors = 4
myst_linkify_fuzzy_links = False
# Headings may skip a level. A page in no table of contents is fine if another links to it, which
# `check.py` demands. Shell cells of notebooks and OpenCV's YAML are neither Python nor YAML to the
# highlighter; types of one name in two modules are linked to the first.
suppress_warnings = ["misc.highlighting_failure", "myst.header", "ref.python", "toc.not_included"]

nb_execution_mode = "cache"
nb_execution_cache_path = str(ROOT / "build/notebooks")
nb_execution_in_temp = True
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
# Not as they stand in the source: options of `collect` stand in no source, but in their model.
autodoc_preserve_defaults = False
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True  # fields of dataclasses are listed once

html_theme = "furo"
html_title = f"Synfeal {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
templates_path = ["templates"]

linkcheck_anchors = False
linkcheck_timeout = 20
linkcheck_ignore = [r"https://s3\.example\.org", r"http://127\.0\.0\.1.*"]


class LinksToFolders(SphinxPostTransform):
    """Show links to folders of the repository as their path: a site has no listing of them."""

    default_priority = 1

    def run(self, **_: object) -> None:
        """Replace such references, which no page or download can answer."""
        folder = Path(self.env.doc2path(self.env.docname)).parent
        for node in list(self.document.findall(nodes.Element)):
            target = node.get("reftarget") or node.get("refuri") or ""
            if "://" in target or target.startswith("#") or not target:
                continue
            if node.get("reftype") == "myst" and (folder / target.partition("#")[0]).is_dir():
                node.replace_self(nodes.literal("", "", *node.children))


def show_references_as_code(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Make code blocks of the BibTeX entries in docstrings, in place."""
    shown, in_entry = [], False
    for line in lines:
        if line.startswith("@") and line.endswith(","):
            in_entry = True
            shown += ["", ".. code-block:: bibtex", ""]
        shown.append(f"   {line}" if in_entry else line)
        if in_entry and line == "}":
            in_entry = False
            shown.append("")
    lines[:] = shown


def setup(app: Sphinx) -> None:
    """Write the reference before pages are read."""
    app.add_post_transform(LinksToFolders)
    app.connect("autodoc-process-docstring", show_references_as_code)
    reference.write_pages(ROOT / "docs/reference")
