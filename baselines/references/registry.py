"""The reference methods: what rules, tables and figures are made from."""

from __future__ import annotations

from collections.abc import Mapping

from baselines.config.references import ExternalConfig
from baselines.registry.declarations import declared
from baselines.registry.kinds import Group, ReferenceMethod

Externals = Mapping[str, ExternalConfig]

REFERENCES = declared(ReferenceMethod)


def in_group(group: Group) -> list[str]:
    """List the methods of a group, in the order of the registry."""
    return [name for name, method in REFERENCES.items() if method.group == group]


def titles_of(external: Externals) -> dict[str, str]:
    """Return titles by name, of the registry's methods and of somebody else's localizers.

    Args:
        external: Localizers of somebody else's by name, as they are configured.
    """
    own = {name: method.title for name, method in REFERENCES.items()}
    return own | {name: method.title for name, method in external.items()}
