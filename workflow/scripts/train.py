from pathlib import Path

from baselines.training.loop import train_localizer
from baselines.training.predict import predict_poses
from baselines.training.record import write_training_record
from synfeal.config.models import LocalizerConfig, NetworkConfig, TrainingConfig
from synfeal.job import job, refuse_restored

outputs, run = snakemake.output, snakemake.params.run
with job(snakemake.log[0]):
    model, predictions = Path(outputs.model), Path(outputs.predictions)
    passed_over = {"records", "common"}  # read with the frames; of the other, which frames it has
    files = {k: file for k, file in snakemake.input.items() if file and k not in passed_over}
    inputs = {name: Path(str(file)) for name, file in files.items()}
    refuse_restored(snakemake.input, predictions)
    data = inputs["frames"], inputs["labels"]
    test = inputs["test_frames"], inputs["test_labels"]
    network, hyper = NetworkConfig(**run["network"]), LocalizerConfig(**run["localizer"])
    training = TrainingConfig(**run["training"], samples_seen={})
    settings = network, hyper, training, run["samples_seen"], inputs.get("weights"), run["seed"]
    history = Path(outputs.history)
    train_localizer(snakemake.wildcards.model, *data, *settings, model, history, test=test)
    write_training_record(Path(outputs.record), run, inputs)
    predict_poses(model, *test, predictions, training.device)
    if out := outputs.get("common"):
        poses, every = Path(snakemake.input.common), snakemake.params.every
        predict_poses(model, test[0], poses, Path(out), training.device, every)
