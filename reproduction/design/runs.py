"""Inputs and settings that a training run of the design depends on."""

from __future__ import annotations

from typing import Any

from reproduction.config.profile import Config
from reproduction.design.experiments import Run


def training_parameters(config: Config, run: Run) -> dict[str, Any]:
    """Return the part of a configuration that a training run depends on, ready for JSON.

    Which poses it learns from is not in it: the hashes of the label files say that.
    """
    hyper = config.training.model_dump(mode="json", exclude={"samples_seen", "repetitions"})
    parameters = {
        "localizer": config.localizers[run.model].model_dump(mode="json"),
        "network": config.network.model_dump(mode="json"),
        "training": hyper,
        "samples_seen": round(run.share * config.training.samples_seen[run.size]),
        "camera": config.network_camera.model_dump(mode="json"),
        "seed": run.seed(config.seed),
    }
    if run.start == "pretrained":
        parameters["pretraining"] = config.pretraining.model_dump(mode="json")
    return parameters
