"""A collection as a configuration of the workflow, in which the mesh is a scene."""

from __future__ import annotations

import yaml

from synfeal.collection.collect import CollectJob
from synfeal.config.dataset import DatasetConfig
from synfeal.dataset.render_sequence import resolved

LEAST_INPUT_PX = 32
HEADER = """\
# The data set of `synfeal collect` with the same options, made by the workflow:
#   synfeal run --profile THIS_FILE -- datasets
# It appears in {directory}
"""


def with_backend(config: DatasetConfig) -> DatasetConfig:
    """The settings with the backend that ``auto`` stands for here: images depend on it.

    Raises:
        InputError: no backend works on this machine.
    """
    return config.model_copy(update={"render": resolved(config.render)})


def configuration_text(job: CollectJob) -> str:
    """The profile as YAML; every key is given, as keys that are not come from the default one."""
    camera = job.config.network_camera
    values = job.config.model_dump(mode="json")
    # The side of packed frames, which the workflow makes for networks, has to fit into the image.
    input_px = job.packed_px or max(LEAST_INPUT_PX, min(64, camera.width - 1, camera.height - 1))
    values |= {"datasets": [job.scene], "network": {"input_px": input_px}}
    directory = job.config.root / "datasets" / job.scene / "network"
    return HEADER.format(directory=directory) + yaml.safe_dump(values, sort_keys=False)
