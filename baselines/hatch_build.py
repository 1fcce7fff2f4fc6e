"""Build hook: depend on the project's other distributions at this one's own version.

They are released together and use each other's internals, so any other version is a mistake. An
sdist carries the result in its ``PKG-INFO``, and building from it does not run the hook again.
"""

from __future__ import annotations

from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface


class SameVersion(MetadataHookInterface):
    """Fill in ``dependencies`` from ``[tool.hatch.metadata.hooks.custom]`` of pyproject.toml."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Pin what ``same-version`` lists, and add the ``dependencies`` beside it."""
        version = metadata["version"]
        pinned = [f"{name}=={version}" for name in self.config["same-version"]]
        metadata["dependencies"] = [*pinned, *self.config["dependencies"]]
