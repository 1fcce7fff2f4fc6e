"""All figures in the order of the report, and the drawing of them to files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from reproduction.design.experiments import Design
from reproduction.figures import (
    error_by_design,
    error_by_method,
    label_ranking,
    label_sets,
    scenes,
    speed_vs_error,
)
from reproduction.figures.sources import Draw, Results
from reproduction.figures.speed_vs_error import of_stage
from reproduction.figures.style import RC
from synfeal.records.files import atomic_path


@dataclass(frozen=True)
class Entry:
    """A figure."""

    draw: Draw
    caption: str  # one sentence
    suffixes: tuple[str, ...] = (".svg", ".png")  # the files it is written to


FIGURES: dict[str, Entry] = {
    "frames": Entry(
        scenes.draw_frames,
        "Collected frames as the localizers see them, evenly over the largest test set of each "
        "scene and labelled with their number in it.",
        (".png",),
    ),
    "poses": Entry(
        scenes.draw_poses,
        "Camera poses of every data set from above, training and test, each with a tick along its "
        "view, over the walls and furniture of the collision mesh (grey), with the frames used.",
    ),
    "trajectories": Entry(
        label_sets.draw_trajectories,
        "Camera paths as each ground-truth method estimated them, over the true ones, from above; "
        "dots are the first frames of batches, wide stretches batches that needed assistance, and "
        "rings the poses that assistance replaced by the true ones.",
    ),
    "label_error": Entry(
        label_sets.draw_label_error,
        "Error of the labels of each ground-truth method along the training and the test sequence, "
        "against the true poses; vertical lines are the borders of batches, and the bars below say "
        "which batches were assisted.",
    ),
    "error_by_noise": Entry(
        error_by_design.draw_by_noise,
        "Median localization error against the noise in the labels, with 95 % limits: above "
        "against the noisy labels of the test set, the paper's protocol, beside the published "
        "values in light grey; below the same predictions against the true poses; dark grey lines "
        "are the mean training pose, the nearest training image and structure on depth.",
    ),
    "references_by_noise": Entry(
        error_by_method.draw_references_by_noise,
        "Median error against the true poses over the errors of the labels that a method learns or "
        "builds its map from: localizers in colour, reference methods in grey; labels from images "
        "stand in the order of the error of structure on depth.",
    ),
    "label_ranking": Entry(
        label_ranking.draw_label_ranking,
        "Which labels rank methods rightly, and down to which threshold: rank correlation between "
        "the ranking of all localizers and reference methods by the labels of the test set and "
        "that of the same predictions by the truth, with 95 % limits over test paths; above for "
        "methods that learn from labels of the same source, as in any benchmark, below for methods "
        "that learn from exact labels, so that only the yardstick differs; no mark stands where "
        "the truth tells no two methods apart.",
    ),
    "error_by_size": Entry(
        error_by_design.draw_by_size,
        "Median localization error against the size of the data set, with 95 % limits, against the "
        "true poses, beside the published values in light grey, which come from the paper's own "
        "meshes and numbers of frames; dark grey lines are the mean training pose, the nearest "
        "training image and, where frames have depth, structure on depth.",
    ),
    "error_by_images": Entry(
        error_by_design.draw_by_images,
        "Median localization error against the true poses after a quarter, half and all of the "
        "images, each a training run of its own length, with 95 % limits.",
    ),
    "robustness": Entry(
        error_by_method.draw_robustness,
        "Median error on the same test paths rendered with effects of a camera and of changing "
        "light, with 95 % limits, for methods that know ideal frames and for those that know "
        "frames with effects mixed in; dotted lines are their errors on ideal frames.",
    ),
    "cumulative_error": Entry(
        error_by_method.draw_cumulative_error,
        "Share of the test frames that each localizer places with at most a given error against "
        "the true poses, in position, in orientation and in both (as many degrees as centimetres), "
        "at the largest size of each scene; the grey line is the median.",
    ),
    "speed_vs_error_collision": Entry(
        of_stage("collision", speed_vs_error.collision_figure),
        "How fast rays are answered against how many decisions of the planner differ from the full "
        "mesh's, for the face counts of the collision mesh that were tried; filled marks form the "
        "Pareto front, the ring is the mesh that is used.",
    ),
    "speed_vs_error_render": Entry(
        of_stage("render", speed_vs_error.render_figure),
        "How long a frame takes against its mean difference from 64 samples per pixel, by backend "
        "and samples per pixel, and with smaller textures or fewer triangles than the scene has; "
        "the ring is what frames are rendered with.",
    ),
    "speed_vs_error_labels": Entry(
        of_stage("labels", speed_vs_error.labels_figure),
        "Frames that each ground-truth method labels per second of processor time against the "
        "median position error of its labels after assistance; filled marks form the Pareto front.",
    ),
    "speed_vs_error_training": Entry(
        of_stage("training", speed_vs_error.training_figure),
        "Images that each localizer learns from per second of processor time, and its median "
        "position error against the true poses, at the largest size of each scene; filled marks "
        "form the Pareto front.",
    ),
}
CAPTIONS: dict[str, str] = {name: entry.caption for name, entry in FIGURES.items()}


DPI = 150
METADATA: dict[str, dict[str, str | None]] = {".png": {"Software": None}, ".svg": {"Date": None}}


def write_figures(design: Design, root: Path, out_dir: Path) -> list[str]:
    """Draw every figure whose inputs the design makes; equal results give equal files.

    Args:
        design: The profile's table of experiments.
        root: Results of the profile.
        out_dir: Folder of the files, which are SVG and PNG, or PNG alone, as ``FIGURES`` says.

    Returns:
        Names of the figures that were drawn, in order.
    """
    results, written = Results(root, design), []
    for name, entry in FIGURES.items():
        with matplotlib.rc_context(rc=RC):
            figure = entry.draw(results)
            if figure is None:
                continue
            for suffix in entry.suffixes:
                save(figure, (out_dir / name).with_suffix(suffix))
            written.append(name)
    return written


def save(figure: Figure, path: Path) -> None:
    """Write one file, without a date."""
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=DPI, metadata=METADATA[path.suffix])
