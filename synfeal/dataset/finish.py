"""The last stage of a data set: manifest, splits, previews, and tables over all frames."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import EffectsConfig
from synfeal.dataset.frame_files import frame_file, sequence_at, sequence_names
from synfeal.dataset.layer_files import ENCODING, MASKS, write_instances
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import read_frames, read_pose_table, write_pose_table
from synfeal.dataset.preview import write_contact_sheet
from synfeal.dataset.sequence_listing import (
    MASK,
    NORMAL,
    RIGHT_COLOR,
    RIGHT_DEPTH,
    list_sequence,
)
from synfeal.dataset.sevenscenes import Sequence as Shard
from synfeal.dataset.sevenscenes import Split, frame_paths, sequences_of, write_splits
from synfeal.effects.apply import effects_table, objects_table
from synfeal.effects.scene import crowd_of
from synfeal.geometry.poses import moved_right
from synfeal.mesh.load import load_mesh
from synfeal.mesh.standing import CLUTTER
from synfeal.records.files import file_sha256, read_json, write_json
from synfeal.records.provenance import frame_versions
from synfeal.records.tables import write_frame
from synfeal.render.choose import graphics


def finish_dataset(
    mesh: Path,
    plans: Sequence[Path],
    camera: CameraConfig,
    counts: Mapping[Split, int],
    shard_frames: int,
    origin: Mapping[str, Any],
    out_manifest: Path,
    coverage: Sequence[Path] = (),
    packed_px: int | None = None,
    detail: Path | None = None,
) -> None:
    """Write what is made of all frames together beside the sequences of a data set.

    Poses with the names of the images, their coverage, split files, contact sheet, manifest. What
    draws is described for the machine that this runs on.

    Args:
        mesh: ``mesh.glb`` of the scene; the manifest records its hash.
        plans: Pose tables of the splits that have frames, in the order of ``counts``.
        camera: Camera of the frames.
        counts: Number of frames of each split.
        shard_frames: Number of frames of a sequence.
        origin: Record of where the frames come from (``DatasetConfig.origin_of``).
        out_manifest: Manifest to write, beside the sequences.
        coverage: What each plan covers, if that is to be written.
        packed_px: Side of packed frames, pixels, if they are written too.
        detail: Record of the level of detail, if it was chosen.
    """
    directory = out_manifest.parent
    splits: list[Split] = [split for split, count in counts.items() if count]
    sequences = sequences_of(counts["train"], counts["test"], shard_frames)
    paths = {s: sequence_at(directory / s.name) for s in sequences}
    write_splits(directory, sequences)
    for split, plan in zip(splits, plans, strict=True):
        own = [s for s in sequences if s.split == split]
        images = [image for s in own for image in s.images]
        write_pose_table(directory / f"{split}.csv", read_frames(plan, 0, counts[split]), images)
        if packed_px is not None:
            pack_frames([paths[s] for s in own], packed_px, directory / f"{split}.npy")
    if coverage:
        covered = {s: read_json(path) for s, path in zip(splits, coverage, strict=True)}
        write_json(directory / "coverage.json", covered)
    write_contact_sheet(frame_paths(list(paths.values()), "color.png"), directory / "preview.png")
    drawn_by = graphics(origin["render"]["backend"])
    origin = {**origin, "render": origin["render"] | {"backend": drawn_by["backend"]}}
    about = {"mesh_sha256": file_sha256(mesh), **origin, **_write_effects(directory, origin, mesh)}
    about["graphics"] = drawn_by
    if detail is not None:
        about["detail"] = read_json(detail)
    about |= _write_layers(directory, list(paths.values()), origin, mesh)
    clutter = mesh.with_name(CLUTTER)
    if places := read_json(clutter) if clutter.is_file() else []:
        about["clutter"] = places
    write_manifest(directory, sequences, camera, about)


def _write_layers(
    directory: Path, sequences: Sequence[Path], origin: Mapping[str, Any], mesh: Path
) -> dict[str, Any]:
    """Write the table of instances where there are masks; encodings of layers for the manifest."""
    held = list_sequence(sequences[0]).numbers
    kinds = {"normals": NORMAL, "masks": MASK}
    encoded = {name: ENCODING[name] for name, kind in kinds.items() if held[kind]}
    if held[MASK]:
        effects = origin["render"].get("effects") or {}
        along_paths = effects.get("clutter") is not None
        write_instances(mesh, load_mesh(mesh), directory / MASKS, along_paths)
    return {"layers": encoded} if encoded else {}


def _write_effects(directory: Path, origin: Mapping[str, Any], mesh: Path) -> dict[str, Any]:
    """Write ``<split>.effects.csv`` where there are effects; hashes for the manifest.

    Which objects stand along the paths is in ``<split>.objects.csv``.
    """
    settings = origin["render"].get("effects")
    if settings is None:
        return {}
    effects, hashes = EffectsConfig(**settings), {}
    crowd = crowd_of(mesh, RenderConfig(effects=effects))
    for plan in sorted(directory / f"{split}.csv" for split in ("test", "train")):
        if plan.is_file():
            poses = read_pose_table(plan)
            tables = {".effects.csv": effects_table(effects, poses)}
            if crowd is not None:
                tables[".objects.csv"] = objects_table(effects, poses, crowd)
            for suffix, table in tables.items():
                write_frame(plan.with_suffix(suffix), table)
                name = plan.with_suffix(suffix).name
                hashes[name] = file_sha256(plan.with_suffix(suffix))
    return {"effects_sha256": hashes}


def write_manifest(
    directory: Path, sequences: Sequence[Shard], camera: CameraConfig, extra: Mapping[str, Any]
) -> None:
    """Write ``manifest.json``: camera, frame counts, hash of each sequence, versions.

    Args:
        directory: Data set with all of its sequences.
        sequences: The sequences, in the order to list them.
        camera: Camera of the frames.
        extra: Further entries, which replace those of the same name.
    """
    record = camera.record
    if camera.fx is not None:  # which replaced the field of view
        del record["horizontal_fov_deg"]
    along = "optical axis" if camera.projection is None else "ray"
    units_per_m = camera.depth_units_per_m
    unit = "millimetres" if units_per_m is None else f"in units of 1/{units_per_m:g} m"
    manifest = {
        "format": f"7-Scenes; depth along the {along}, {unit}, 65535 invalid",
        "camera": record,
        **_stereo(camera),
        "frames": {
            split: sum(len(s) for s in sequences if s.split == split) for split in ("train", "test")
        },
        "sequences": [
            {
                "name": s.name,
                "split": s.split,
                "frames": len(s),
                "sha256": sequence_sha256(sequence_at(directory / s.name)),
            }
            for s in sequences
        ],
        "versions": frame_versions(),
        **extra,
    }
    write_json(directory / MANIFEST, manifest)


def _stereo(camera: CameraConfig) -> dict[str, Any]:
    """State the right camera of a pair in the frame of the left one, whose poses frames have."""
    if camera.stereo_baseline_m is None:
        return {}
    left_from_right = moved_right(np.eye(4), camera.stereo_baseline_m).tolist()
    return {
        "stereo": {
            "baseline_m": camera.stereo_baseline_m,
            "left_from_right": left_from_right,
            "poses": "world_from_cam @ left_from_right",
            "files": [RIGHT_COLOR, RIGHT_DEPTH],
        }
    }


def sequence_sha256(sequence: Path) -> str:
    """Hash the names and contents of the frames in order of name, archived or not, by SHA-256."""
    digest = hashlib.sha256()
    for name in sequence_names(sequence):
        if name.startswith("frame-"):
            content = hashlib.sha256(frame_file(sequence, name).read_bytes()).hexdigest()
            digest.update(f"{content}  {name}\n".encode())
    return digest.hexdigest()
