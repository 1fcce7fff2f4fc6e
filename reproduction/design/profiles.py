"""Profiles by the names that commands take."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from reproduction.config.load import load_config
from reproduction.config.profile import Config
from reproduction.design.experiments import design_name, idle_scenes, read_design
from reproduction.design.files import Files
from reproduction.design.labels import check_sources
from synfeal.config.load import read_yaml
from synfeal.errors import InputError

FOLDER = Path("config")
DEFAULT = FOLDER / "config.yaml"


def read_profile(name: str) -> Files:
    """Read a profile and its design.

    Args:
        name: Name of a profile in ``config/``, or the path of its file.

    Raises:
        InputError: There is no such profile, or it is wrong.
    """
    path = profile_path(name)
    paths = [path] if is_default(path) else [DEFAULT, path]
    config = load_config(*paths)
    refuse_idle_scenes(config, paths)
    design = read_design(config)
    check_sources(design.rows, design_name(config))
    return Files(config, design)


def refuse_idle_scenes(config: Config, paths: Iterable[Path]) -> None:
    """Refuse a scene that a profile adds to the default ones and then makes no frames of.

    Without rows of its own a profile has those of the default one, which take hours and are of
    other scenes.

    Args:
        config: The merged profile.
        paths: Files that it was merged from.

    Raises:
        InputError: There is such a scene.
    """
    scenes = {path: read_yaml(path).get("scenes") or {} for path in paths}
    usual = {scene for path in scenes if is_default(path) for scene in scenes[path]}
    idle = set(idle_scenes(config)) - usual
    for path in scenes:
        for scene in scenes[path]:
            if usual and scene in idle:
                size = next(iter(config.scenes[scene].sizes), "small")
                raise InputError(
                    path,
                    f"scenes.{scene}: nothing would be made of it, as no row of"
                    f" {design_name(config)} is of this scene",
                    "add one to the file: experiments:"
                    f" [{{table: table4_size, scene: {scene}, size: {size}}}]",
                )


def is_default(path: Path) -> bool:
    """Tell whether a file is the one that all others extend; links may form a circle."""
    return os.path.realpath(path) == os.path.realpath(DEFAULT)


def profile_path(name: str) -> Path:
    """Return the file of a profile, by name or path.

    Raises:
        InputError: No profile has this name.
    """
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    paths = sorted(FOLDER.glob("*.yaml"))
    if not paths:
        raise InputError(
            f"profile '{name}'",
            f"there is no folder {FOLDER}/ with profiles here",
            "go to a clone of the repository, or name a YAML file",
        )
    found = {str(read_yaml(path).get("profile", path.stem)): path for path in paths}
    if name not in found:
        known = ", ".join(sorted(found))
        raise InputError(f"profile '{name}'", f"no such profile in {FOLDER}/; known: {known}")
    return found[name]
