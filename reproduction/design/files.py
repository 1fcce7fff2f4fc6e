"""Files of a profile that follow from its configuration and its design.

Rules ask here for lists of inputs. Nothing here knows Snakemake or looks at the disk.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from baselines.config.learning import MODELS
from baselines.labels.batches import Batch, batches_of
from baselines.labels.methods import stages_of
from baselines.localizers.registry import backbone_of
from reproduction.config.profile import Config
from reproduction.config.robustness import MIXED
from reproduction.design.experiments import Design, Run, common_every, split_init
from reproduction.design.references import DataSet, answered_by, data_sets, has_depth_frames
from synfeal.config.dataset import RenderConfig
from synfeal.config.effects import CLEAN, EffectsConfig
from synfeal.dataset.frame_files import SUFFIX
from synfeal.dataset.sevenscenes import Sequence, sequences_of
from synfeal.effects.files import carton_files, light_share_files

SPLITS = ("train", "test")
REFERENCE_FILES = ("predictions.csv", "errors.csv", "metrics.json", "facts.json")
# Tables that figures are drawn from.
DRAWN_TABLES = ("table3_inconsistencies", "table4_size", "table7_images_shown")


@dataclass(frozen=True)
class Files:
    """Names of the files of a profile, below its results.

    In all methods ``scene`` and ``size`` are keys of the profile, ``split`` is ``train`` or
    ``test``, ``camera`` is ``network`` or ``estimation``, and ``method`` is a label method.

    Args:
        config: The profile.
        design: Its table of experiments.
    """

    config: Config
    design: Design

    @cached_property
    def root(self) -> str:
        """Directory of the results."""
        return self.config.root.as_posix()

    # The design

    @cached_property
    def scenes(self) -> list[str]:
        """Scenes of the design."""
        return sorted({row.scene for row in self.design.rows})

    @cached_property
    def sizes(self) -> list[tuple[str, str]]:
        """Scenes and sizes of the design."""
        return sorted({(row.scene, row.size) for row in self.design.rows})

    @cached_property
    def depth_sizes(self) -> list[tuple[str, str]]:
        """Scenes and sizes of which large frames with depth are rendered.

        Labels are estimated from them, or reference methods answer from them.
        """
        rows, references = self.design.rows, self.config.references
        labelled = {(scene, size) for scene, size, _ in self.design.estimated}
        matched = {key for key in self.sizes if has_depth_frames(rows, *key, references)}
        return sorted(labelled | matched)

    @cached_property
    def depth_scenes(self) -> list[str]:
        """Scenes of which such frames are rendered."""
        return sorted({scene for scene, _ in self.depth_sizes})

    @cached_property
    def tables(self) -> list[str]:
        """Tables of training runs, the paper's and ours."""
        return self.design.tables

    @cached_property
    def drawn_tables(self) -> list[str]:
        """Those of them that figures are drawn from."""
        return [table for table in self.tables if table in DRAWN_TABLES]

    @cached_property
    def backbones(self) -> list[str]:
        """Backbones that runs start from with transfer learning."""
        models = {run.model for run in self.design.runs if run.start == "pretrained"}
        return sorted({backbone_of(model, self.config.network) for model in models})

    # Frames

    def n_frames(self, scene: str, camera: str, split: str) -> int:
        """Count the frames of a split that are rendered with a camera: no more than are used.

        Args:
            scene: Name of the scene.
            camera: ``network`` for frames that localizers see, ``estimation`` for large ones with
                depth.
            split: ``train`` or ``test``.

        Returns:
            Frames of the largest size that needs them; 0 where none does. Scenes that no row of the
            design is of have all their frames rendered with ``network``.
        """
        if camera == "network":
            sizes = {size for of, size in self.sizes if of == scene}
            if not sizes:
                return self.config.n_largest(scene, split)
        else:
            sizes = {size for of, size in self.depth_sizes if of == scene}
        return max((self.config.n_frames(scene, size, split) for size in sizes), default=0)

    def sequences(self, scene: str, camera: str) -> list[Sequence]:
        """List the parts that the frames of a camera are rendered in, of both splits."""
        n_train, n_test = (self.n_frames(scene, camera, split) for split in SPLITS)
        return sequences_of(n_train, n_test, self.config.shard_frames)

    def sequence(self, scene: str, camera: str, name: str) -> Sequence:
        """Return the part of this name, such as ``seq-01``."""
        return next(s for s in self.sequences(scene, camera) if s.name == name)

    def packed_shards(self, scene: str, split: str, kind: str) -> list[str]:
        """List the parts of a split's packed frames, in order.

        Args:
            scene: Name of the scene.
            split: ``train`` or ``test``.
            kind: ``npy`` for the frames, ``json`` for the files that describe them.
        """
        sequences = (s for s in self.sequences(scene, "network") if s.split == split)
        return [f"{self.root}/frames/{scene}/shards/{s.name}.{kind}" for s in sequences]

    def sequence_dirs(
        self, scene: str, camera: str, split: str | None = None, stop: int | None = None
    ) -> list[str]:
        """List sequences of image files, directories or archives.

        Args:
            scene: Name of the scene.
            camera: ``network`` or ``estimation``.
            split: ``train`` or ``test``; None for both.
            stop: List only sequences with frames below this one in their split; None for all.
        """
        suffix = SUFFIX if self.config.archive_sequences else ""
        return [
            f"{self.root}/datasets/{scene}/{camera}/{s.name}{suffix}"
            for s in self.sequences(scene, camera)
            if split in (None, s.split) and (stop is None or s.start < stop)
        ]

    def plans(self, scene: str, camera: str, kind: str) -> list[str]:
        """List the plans of the splits that have frames.

        Args:
            scene: Name of the scene.
            camera: ``network`` or ``estimation``.
            kind: ``csv`` for the poses, ``coverage.json`` for what they cover: only of ``network``,
                which alone renders whole plans.
        """
        if kind != "csv" and camera != "network":
            return []
        splits = [split for split in SPLITS if self.n_frames(scene, camera, split)]
        return [f"{self.root}/plans/{scene}/{split}.{kind}" for split in splits]

    def manifests(self, camera: str) -> list[str]:
        """List data sets of image files."""
        scenes = self.scenes if camera == "network" else self.depth_scenes
        return [f"{self.root}/datasets/{scene}/{camera}/manifest.json" for scene in scenes]

    def light_shares(self, scene: str, effects: EffectsConfig | None) -> list[str]:
        """List shares of a scene's light, where effects switch its lamps."""
        switched = effects and effects.light and effects.light.states
        if not switched:
            return []
        return [path.as_posix() for path in light_share_files(self.mesh(scene)).values()]

    def cartons(self, scene: str) -> list[str]:
        """List the built-in objects of a scene."""
        return [path.as_posix() for path in carton_files(self.mesh(scene))]

    def mesh(self, scene: str) -> Path:
        """Return the mesh of a scene."""
        return self.config.root / "scenes" / scene / "mesh.glb"

    def beside_mesh(self, scene: str, effects: EffectsConfig | None) -> list[str]:
        """List files that effects need of a scene: shares of its light, and objects."""
        clutter = effects.clutter if effects else None
        own = [path.as_posix() for path in clutter.files] if clutter else []
        built_in = self.cartons(scene) if clutter and not clutter.files else []
        return [*self.light_shares(scene, effects), *own, *built_in]

    def detail(
        self, scene: str, camera: str, kind: str, render: RenderConfig | None = None
    ) -> str | None:
        """Return the level of detail that a camera's colours are drawn of.

        Args:
            scene: Name of the scene.
            camera: ``network`` or ``estimation``.
            kind: ``glb`` for the mesh, ``json`` for the record of how it was chosen.
            render: Settings of rendering; None for the profile's own.

        Returns:
            The file; None where the full mesh is drawn.
        """
        if (render or self.config.render).draws_full_mesh:
            return None
        return f"{self.root}/scenes/{scene}/detail_{camera}.{kind}"

    def cameras(self, scene: str) -> list[str]:
        """List cameras that frames of a scene are rendered through."""
        return ["network", *(["estimation"] if scene in self.depth_scenes else [])]

    def details(self, scene: str, kind: str) -> list[str]:
        """List levels of detail of these cameras; none where the full mesh is drawn."""
        found = [self.detail(scene, camera, kind) for camera in self.cameras(scene)]
        return [path for path in found if path is not None]

    # Labels

    def batches(self, scene: str, size: str, split: str) -> list[Batch]:
        """List batches that the labels of a split are estimated in."""
        count = self.config.n_frames(scene, size, split)
        return batches_of(count, self.config.estimation.batch_frames)

    def batch(self, scene: str, size: str, split: str, index: str) -> Batch:
        """Return a batch by its number in file names, such as ``003``."""
        return self.batches(scene, size, split)[int(index)]

    def frames_of_batch(self, scene: str, size: str, split: str, index: str) -> list[str]:
        """List sequences of image files up to the one that a batch ends in."""
        stop = self.batch(scene, size, split, index).stop
        return self.sequence_dirs(scene, "estimation", split, stop)

    def batch_files(self, scene: str, size: str, method: str, split: str) -> list[str]:
        """List trajectories of all batches of a split by one method."""
        folder = f"{self.root}/estimates/{scene}/{size}/{method}/{split}"
        return [f"{folder}/batch-{b.index:03d}.csv" for b in self.batches(scene, size, split)]

    @cached_property
    def estimated_batches(self) -> list[str]:
        """All batches of the estimated label sets, stage by stage, below ``estimates``."""
        return sorted(
            {
                f"{scene}/{size}/{stage}/{split}/batch-{b.index:03d}"
                for scene, size, method in self.design.estimated
                for stage in stages_of(method)
                for split in SPLITS
                for b in self.batches(scene, size, split)
            }
        )

    @cached_property
    def true_sets(self) -> list[str]:
        """Sets of true labels."""
        return [f"{scene}/{size}/synfeal" for scene, size in self.sizes]

    @cached_property
    def estimated_sets(self) -> list[str]:
        """Estimated label sets."""
        return ["/".join(names) for names in self.design.estimated]

    @cached_property
    def pose_sets(self) -> list[str]:
        """Sets of true and of estimated labels."""
        return sorted({*self.true_sets, *self.estimated_sets})

    # Training runs and reference methods

    def runs_of(self, table: str) -> list[str]:
        """List folders of the runs that a table reads."""
        return [run.directory for run in self.design.table_runs(table)]

    def of_runs(self, file: str) -> list[str]:
        """List a file of every run."""
        return [f"{self.root}/runs/{run.directory}/{file}" for run in self.design.runs]

    def weights(self, model: str, init: str) -> str | None:
        """Return the backbone that a run starts from; None where it starts from scratch."""
        if split_init(init)[0] == "scratch":
            return None
        return f"{self.root}/pretrained/{backbone_of(model, self.config.network)}.pt"

    def common_test_set(self, scene: str) -> tuple[str, int]:
        """Return the test frames that localizers of all sizes answer, beside their own.

        Returns:
            True poses of the scene's largest test set, and one in how many of its frames is taken.
        """
        sizes = {size for of, size in self.sizes if of == scene}
        counts = {self.config.n_frames(scene, size, "test"): size for size in sizes}
        largest = counts[max(counts)]
        return f"{self.root}/labels/{scene}/{largest}/synfeal/test.csv", common_every(counts)

    def n_of_size(self, scene: str, size: str) -> int:
        """Count frames of both splits of a size, which a training run holds in memory."""
        return sum(self.config.n_frames(scene, size, split) for split in SPLITS)

    def smallest_train(self, scene: str) -> int:
        """Count training frames of a scene's smallest size."""
        sizes = {size for of, size in self.sizes if of == scene}
        return min(self.config.n_frames(scene, size, "train") for size in sizes)

    def references(self) -> dict[DataSet, list[str]]:
        """List reference methods that answer for each data set."""
        rows, settings = self.design.rows, self.config.references
        return {key: answered_by(rows, key, settings) for key in data_sets(rows)}

    @cached_property
    def reference_answers(self) -> list[str]:
        """Every reference method and data set, below ``references``."""
        return [
            f"{'/'.join(key)}/{name}" for key, names in self.references().items() for name in names
        ]

    def external_poses(self, name: str, data_set: Mapping[str, str]) -> str | None:
        """Return the file with answers of an external localizer; None where it is run here.

        Args:
            name: Name of the localizer, a key of ``references.external``.
            data_set: Its ``scene``, ``size`` and ``labels``.
        """
        pattern = self.config.references.external[name].poses
        return pattern.format(**data_set) if pattern else None

    def reference_files(self, folder: str, names: Iterable[str]) -> list[str]:
        """List the files that reference methods write in the folder of one data set."""
        return [f"{folder}/{name}/{file}" for name in names for file in REFERENCE_FILES]

    # Robustness: test frames with effects

    @cached_property
    def variations(self) -> dict[str, EffectsConfig]:
        """Effects of the robustness table by name, ``mixed`` among them."""
        robust = self.config.robustness
        scene = self.config.scenes.get(robust.scene)
        own_mesh = scene is not None and scene.source == "mesh"
        return robust.rendered(self.config.collection, own_mesh)

    @cached_property
    def tested_effects(self) -> list[str]:
        """Effects that test frames are rendered with."""
        return [name for name in self.variations if name != MIXED]

    @cached_property
    def robust_set(self) -> str:
        """Label set of the robustness table."""
        robust = self.config.robustness
        return f"{robust.scene}/{robust.size}/synfeal"

    def robust_run(self, model: str) -> Run:
        """Return the localizer trained on frames without effects."""
        robust = self.config.robustness
        return Run(robust.scene, robust.size, "synfeal", "pretrained", model, repetition=0)

    @property
    def has_robustness(self) -> bool:
        """Tell whether the robustness table has rows: effects, and runs on its data set."""
        robust = self.config.robustness
        if not (robust.made and self.tested_effects):
            return False
        tested = {self.robust_run(model).directory for model in MODELS}
        return any(run.directory in tested for run in self.design.runs)

    @property
    def has_robust_structure(self) -> bool:
        """Tell whether frames with depth are rendered of its data set."""
        robust = self.config.robustness
        return has_depth_frames(self.design.rows, robust.scene, robust.size, self.config.references)

    def robust_frames(self, split: str) -> int:
        """Count frames of a split of the robustness table's data set."""
        robust = self.config.robustness
        return self.config.n_frames(robust.scene, robust.size, split)

    def varied_detail(self, effects: str, kind: str) -> str | None:
        """Return the file of :meth:`detail` for frames with a variation."""
        scene = self.config.robustness.scene
        return self.detail(scene, "network", kind, self.varied_render(effects))

    def varied_render(self, effects: str) -> RenderConfig:
        """Return settings of rendering with a variation; ``clean`` is the profile's own."""
        chosen = self.variations.get(effects, self.config.render.effects)
        return self.config.render.model_copy(update={"effects": chosen})

    def varied_extras(self, names: Iterable[str]) -> list[str]:
        """List files that variations need of the scene beside its mesh."""
        scene = self.config.robustness.scene
        effects = [self.varied_render(name).effects for name in names]
        return sorted({file for each in effects for file in self.beside_mesh(scene, each)})

    def varied_structure(self) -> list[str]:
        """List structure-based poses of the varied test frames."""
        names = [CLEAN, *self.tested_effects] if self.has_robust_structure else []
        return [f"{self.root}/robustness/structure/{name}.csv" for name in names]

    def effects_speed(self) -> list[str]:
        """List the file of what effects cost, where figures of runs are drawn."""
        if not (self.has_robustness and self.drawn_tables):
            return []
        return [f"{self.root}/scenes/{self.config.robustness.scene}/effects_speed.csv"]
