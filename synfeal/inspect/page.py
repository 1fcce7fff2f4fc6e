"""The page: one file that opens offline, with the numbers, the picture and the mesh to turn."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any

from jinja2 import Environment, PackageLoader

from synfeal.inspect.text import Section
from synfeal.inspect.viewer_mesh import viewer_js


def page_html(
    title: str,
    doubts: Sequence[str],
    sections: Sequence[Section],
    snippet: str,
    picture_png: bytes,
    scene: dict[str, Any],
) -> str:
    """The page as HTML, with nothing to load from elsewhere.

    Args:
        title: heading.
        doubts: sentences to stand out at the top.
        sections: tables of numbers.
        snippet: lines for a configuration file and for a shell.
        picture_png: the picture.
        scene: what :meth:`synfeal.inspect.viewer_mesh.ViewerMesh.scene` returns.
    """
    loader = PackageLoader("synfeal.inspect", ".")
    pages = Environment(loader=loader, autoescape=True, keep_trailing_newline=True)
    return pages.get_template("page.html").render(
        title=title,
        doubts=doubts,
        sections=sections,
        snippet=snippet,
        picture=base64.b64encode(picture_png).decode("ascii"),
        scene=json.dumps(scene, allow_nan=False).replace("<", "\\u003c"),
        viewer=viewer_js(),
    )
