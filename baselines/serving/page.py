"""The page that shows where a photograph was taken."""

from __future__ import annotations

import base64

from jinja2 import Environment, PackageLoader, StrictUndefined

from baselines.places.report import SCALE_STEPS_M
from baselines.serving.place import ServedPlace


def page_of(place: ServedPlace) -> str:
    """Return the page of a place, which needs no other file."""
    pages = Environment(
        loader=PackageLoader("baselines.serving", "."), autoescape=True, undefined=StrictUndefined
    )
    plan = place.plan
    scale_m = max((m for m in SCALE_STEPS_M if m <= plan.width_m / 4), default=SCALE_STEPS_M[0])
    return pages.get_template("page.html.j2").render(
        name=place.name,
        frames=len(place.map),
        world=place.world,
        has_renderings=place.has_renderings,
        plan=plan,
        plan_png=base64.b64encode(plan.png).decode("ascii"),
        plan_from_world=plan.plan_from_world.tolist(),
        scale_m=scale_m,
    )
