"""The collection of ``synfeal collect`` as a profile, from which the workflow makes the same."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from reproduction.config.dataset import DatasetConfig, SizeConfig, SizedScene
from synfeal.collection.run import CollectJob
from synfeal.config.collect import SCENE, CollectConfig
from synfeal.dataset.render_sequence import resolved

SIZE = "all"  # what the profile of a collection calls its size
LEAST_INPUT_PX = 32
SAMPLES_SEEN = (
    14_000  # images shown to each localizer, as in the smallest set of the default profile
)
HEADER = """\
# The data set of `synfeal collect` with the same options, made by the workflow:
#   synfeal run --profile THIS_FILE -- datasets
# It appears in {root}/datasets/{scene}/network
"""
TRAINED = """\
# The five localizers trained and tested on it, up to {root}/report.html:
#   synfeal run --profile THIS_FILE
"""
UNTRAINED = """\
# There are no test frames: for localizers to be trained and tested too, give --test-frames.
"""
WIDE = """\
# Localizers are trained and compared on perspective images; on these: synfeal train.
"""


def profile_of(config: CollectConfig, out: Path) -> DatasetConfig:
    """Compose the settings of a collection as those of a profile, named after its data set."""
    name = re.sub(r"[^a-z0-9]+", "_", out.absolute().name.lower()).strip("_")[:64]
    scene = CollectJob(config, out).scene.model_copy(update={"path": config.mesh.absolute()})
    repeat = config.poses and config.poses.absolute()
    sizes = {SIZE: SizeConfig(train=config.frames, test=config.test_frames)}
    return DatasetConfig(
        profile=name or "mine",
        seed=config.seed,
        scale=1.0,
        shard_frames=config.sequence_frames,
        archive_sequences=config.archive,
        scenes={SCENE: SizedScene(**dict(scene), sizes=sizes)},
        collection=config.collection.model_copy(update={"repeat": repeat}),
        network_camera=config.view,
        network_depth=config.depth,
        network_normals=config.normals,
        network_masks=config.masks,
        render=resolved(config.render),
    )


def configuration_text(config: CollectConfig, out: Path) -> str:
    """Write the profile as YAML with every key, as missing keys come from the default profile.

    Where there are test frames, its design is one row: the localizers on this data set.
    """
    profile, camera = profile_of(config, out), config.view
    values = profile.model_dump(mode="json")
    # The side of packed frames, which the workflow makes for networks, has to fit into the image.
    input_px = config.packed_px or max(LEAST_INPUT_PX, min(64, camera.width - 1, camera.height - 1))
    values |= {"datasets": [SCENE], "network": {"input_px": input_px}}
    is_tested = config.test_frames > 0 and camera.projection is None
    if is_tested:
        values["experiments"] = [{"table": "table4_size", "scene": SCENE, "size": SIZE}]
        values["training"] = {"samples_seen": {SIZE: SAMPLES_SEEN}}
    untrained = UNTRAINED if camera.projection is None else WIDE
    header = HEADER + (TRAINED if is_tested else untrained)
    named = {"root": profile.root, "scene": SCENE}
    return header.format(**named) + yaml.safe_dump(values, sort_keys=False)
