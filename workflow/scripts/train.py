from pathlib import Path

from baselines.training.loop import train_localizer
from baselines.training.predict import predict_poses
from synfeal.config.models import LocalizerConfig, NetworkConfig, TrainingConfig
from synfeal.job import job

inputs, outputs, params = snakemake.input, snakemake.output, snakemake.params
with job(snakemake.log[0]):
    name, model = snakemake.wildcards.model, Path(outputs.model)
    network, hyper = NetworkConfig(**params.network), LocalizerConfig(**params.localizer)
    training = TrainingConfig(**params.training, samples_seen={})
    weights = Path(str(inputs.weights)) if inputs.weights else None
    frames, labels = Path(inputs.frames), Path(inputs.labels)
    test_frames, test_labels = Path(inputs.test_frames), Path(inputs.test_labels)
    train_localizer(
        name,
        frames,
        labels,
        network,
        hyper,
        training,
        params.samples_seen,
        weights,
        params.seed,
        model,
        Path(outputs.history),
        test=(test_frames, test_labels),
    )
    predict_poses(model, test_frames, test_labels, Path(outputs.predictions), training.device)
