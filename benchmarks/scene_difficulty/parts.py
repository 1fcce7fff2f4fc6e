"""The three parts of the measurement: each ends in tables of its own."""

from __future__ import annotations

from functools import cache

from baselines.groundtruth.trajectory import read_trajectory
from benchmarks.scene_difficulty.batches import BATCH_COLUMNS, assistance_summary, batch_rows
from benchmarks.scene_difficulty.coverage import FRAME_COLUMNS as COVERAGE_COLUMNS
from benchmarks.scene_difficulty.coverage import coverage_rows, coverage_summary
from benchmarks.scene_difficulty.features import Features, extract_features
from benchmarks.scene_difficulty.pool import run_tasks
from benchmarks.scene_difficulty.reconstruction import STAGE_OF, STAGES, BatchFiles, reconstruct
from benchmarks.scene_difficulty.repetition import FRAME_COLUMNS as REPETITION_COLUMNS
from benchmarks.scene_difficulty.repetition import (
    MAX_FEATURES,
    best_matches,
    count_matches,
    repetition_rows,
    repetition_summary,
)
from benchmarks.scene_difficulty.survey import Survey, render_missing
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.report.tables import write_rows
from synfeal.seeds import seed_of

# Frames whose features one task finds.
_TASK_FRAMES = 50


def measure_sift(survey: Survey) -> None:
    """Share of the pixels near a feature, and features per frame."""
    features = sample_features(survey)
    rows = coverage_rows(survey.sample, features, survey.cfg.groundtruth_camera)
    write_rows(survey.table("sift_frames"), COVERAGE_COLUMNS, rows)
    summary = coverage_summary(survey.scene, rows)
    write_rows(survey.table("sift"), list(summary), [summary])


def measure_repetition(survey: Survey) -> None:
    """How often the most similar frame of another path was taken far away."""
    features = [found.first(MAX_FEATURES) for found in sample_features(survey)]
    best = best_matches(count_matches(features, survey.jobs), survey.sample)
    rows = repetition_rows(survey.sample, best)
    write_rows(survey.table("repetition_frames"), REPETITION_COLUMNS, rows)
    summary = repetition_summary(survey.scene, best)
    write_rows(survey.table("repetition"), list(summary), [summary])


def measure_batches(survey: Survey) -> None:
    """SfM and RGB-D odometry on the batches; those that are done are not done again."""
    reconstruct_missing(survey)
    truth, cfg = survey.truth, survey.cfg.groundtruth
    rows, totals = [], []
    for method in STAGE_OF:
        files = [_files_of(survey, batch.index) for batch in survey.batches]
        estimates = [read_trajectory(file.trajectory(method)) for file in files]
        cpu_s = [file.read_seconds(method) for file in files]
        found = batch_rows(survey.scene, method, survey.batches, estimates, truth, cfg, cpu_s)
        rows += found
        totals.append(assistance_summary(found, cfg.batch_frames))
    write_rows(survey.table("batches"), BATCH_COLUMNS, rows)
    write_rows(survey.table("assistance"), list(totals[0]), totals)


@cache
def sample_features(survey: Survey) -> list[Features]:
    """Features of the sample's frames, found once."""
    render_missing(survey, {survey.sample_dir: survey.sample})
    color = frame_paths([survey.sample_dir], "color.png")
    limit = survey.cfg.groundtruth.sfm.max_features
    starts = range(0, len(color), _TASK_FRAMES)
    tasks = [(color[start : start + _TASK_FRAMES], limit) for start in starts]
    return [
        features
        for found in run_tasks(extract_features, tasks, survey.jobs, "features")
        for features in found
    ]


def reconstruct_missing(survey: Survey) -> None:
    """Render and reconstruct the batches that have no result yet."""
    missing = [
        (stage, batch)
        for batch in survey.batches
        for stage in STAGES
        if not _files_of(survey, batch.index).seconds(stage).exists()
    ]
    poses = {batch: survey.truth.between(batch.start, batch.stop) for batch in survey.batches}
    render_missing(survey, {survey.batch_dir(batch): poses[batch] for _, batch in missing})
    tasks = [
        (
            stage,
            survey.batch_dir(batch),
            poses[batch],
            survey.cfg.groundtruth_camera,
            survey.cfg.groundtruth,
            seed_of(survey.cfg.seed, "sfm", survey.scene, batch.index),
            _files_of(survey, batch.index),
        )
        for stage, batch in missing
    ]
    run_tasks(reconstruct, tasks, survey.jobs, "batches")


def _files_of(survey: Survey, batch_index: int) -> BatchFiles:
    return BatchFiles(survey.out / survey.scene / "batches", batch_index)


PARTS = {"sift": measure_sift, "repetition": measure_repetition, "batches": measure_batches}
