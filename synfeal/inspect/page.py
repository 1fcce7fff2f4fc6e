"""The page: one file that opens offline, with the numbers, the picture and the mesh to turn."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

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
    template = files("synfeal.inspect").joinpath("page.html").read_text(encoding="utf-8")
    return Template(template).substitute(
        title=escape(title),
        doubts=_doubts(doubts),
        sections="\n".join(_section(section) for section in sections),
        snippet=escape(snippet),
        picture=base64.b64encode(picture_png).decode("ascii"),
        scene=json.dumps(scene, allow_nan=False).replace("<", "\\u003c"),
        viewer=viewer_js(),
    )


def _doubts(doubts: Sequence[str]) -> str:
    if not doubts:
        return ""
    items = "".join(f"<li>{escape(doubt)}</li>" for doubt in doubts)
    return f'<div class="doubts">Look at this first:<ul>{items}</ul></div>'


def _section(section: Section) -> str:
    rows = "".join(
        f"<tr><th>{escape(label)}</th><td>{escape(value)}</td></tr>"
        for label, value in section.rows
    )
    return f"<section><h2>{escape(section.title)}</h2><table>{rows}</table></section>"
