"""Mistakes of a hasty person: one table for all commands, and the files that get in the way."""

import shutil

from PIL import Image

# Values that an option is given by mistake; `{name}` is a file of :func:`make_folder`.
PLACES = ("", "absent", "notes.txt/x", "loop", "loop/x", "x" * 300)
NUMBERS = ("-1", "0", "nan", "inf", "-inf", "1e30")
WHOLE = ("-1", "0", "99999999999", "9" * 400)
TEXTS = ("empty", "notes.txt", "latin.txt")
DATA_SETS = (*PLACES, "notes.txt", "empty", "photos", "text.glb")
MESHES = (
    *(*PLACES, ".", "x" * 5000, "notes.txt", "empty", "text.glb", "cut.glb", "nothing.obj"),
    *("latin.txt", "image.glb", "list.gltf", "short.ply"),
)
OUTS = ("/", ".", "notes.txt", "notes.txt/x", "loop", "loop/x", "x" * 300, "photos")

# Files that Snakemake reads before the Snakefile can refuse them, a clone's Snakefile, and meshes.
FILES = {
    "Snakefile": b"",
    "deep.yaml": b"{a: " * 5000,
    "dup.yaml": b"seed: 1\nseed: 2\n",
    "latin.yaml": b"profile: caf\xe9\n",
    "list.yaml": b"- 1\n",
    "empty.yaml": b"# nothing yet\n",
    "broken.yaml": b"seed: [1\nscale: {",
    "image.yaml": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    "alias.yaml": b"scenes: &all {a: *all}\n",
    "list.gltf": b'{"asset": {"version": "2.0"}, "scenes": "all", "nodes": 3}',
    "short.ply": b"ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nend_header\n1\n",
}
CONFIGURATION_FILES = (
    *("absent.yaml", "folder.yaml", "loop.yaml"),
    *(name for name in FILES if name.endswith(".yaml")),
)

COLLECT = "collect room.glb --frames 2 --out new --width 40 --height 33"
# A command that works, an option of it (or the place of an argument), and values that do not.
TABLE = {
    "collect mesh": (COLLECT.replace("room.glb", "{}"), "", MESHES),
    "collect out": (COLLECT, "--out", OUTS),
    "collect frames": (COLLECT, "--frames", WHOLE),
    "collect test frames": (COLLECT, "--test-frames", ("-1", "99999999999")),
    "collect spacing": (COLLECT, "--spacing", (*NUMBERS, "1e-9")),
    "collect clearance": (COLLECT, "--min-clearance", ("-1", "nan", "inf", "1e30")),
    "collect view": (COLLECT, "--min-view-distance", ("-1", "nan", "inf", "1e30")),
    "collect path": (COLLECT, "--min-path", ("-1", "nan", "inf", "1e30")),
    "collect unit": (COLLECT, "--unit", (*NUMBERS, "1e-5")),
    "collect box": (COLLECT, "--box", ("1 0 0 1 0 1", "nan 1 0 1 0 1")),
    "collect roll": (COLLECT, "--roll", ("5 -5", "nan 1", "0 inf")),
    "collect pitch": (COLLECT, "--pitch", ("-90 90", "1 1")),
    "collect yaw": (COLLECT, "--yaw", ("180 -180",)),
    "collect seed": (COLLECT, "--seed", ("-1", "9" * 400)),
    "collect width": (COLLECT, "--width", ("0", "-1", "8193", "100000", "9" * 400)),
    "collect height": (COLLECT, "--height", ("0", "8193")),
    "collect fov": (COLLECT, "--fov", (*NUMBERS, "180")),
    "collect camera": (COLLECT, "--camera", (*PLACES, ".", *TEXTS, "x" * 5000)),
    "collect poses": (f"{COLLECT} --mode repeat", "--poses", (*PLACES[1:], ".", *TEXTS)),
    "collect mode": (COLLECT, "--mode", ("repeat", "teleport")),
    "collect effects": (COLLECT, "--effects", (*PLACES, *TEXTS)),
    "collect clutter": (COLLECT, "--clutter", (*PLACES, *TEXTS)),
    "collect background": (COLLECT, "--background", ("0 0 256", "-1 0 0")),
    "collect supersampling": (COLLECT, "--supersampling", ("0", "-1", "5", "9" * 400)),
    "collect workers": (COLLECT, "--cores", ("0", "-3")),
    "collect packed": (COLLECT, "--packed", ("0", "-5", "33", "100000", "9" * 400)),
    "collect sequences": (COLLECT, "--sequence-frames", WHOLE),
    "inspect mesh": ("inspect {}", "", MESHES),
    "inspect out": ("inspect room.glb", "--out", OUTS),
    "inspect unit": ("inspect room.glb", "--unit", NUMBERS),
    "inspect box": ("inspect room.glb", "--box", ("1 0 0 1 0 1",)),
    "preview": ("preview {} --out new.gif", "", DATA_SETS),
    "preview out": ("preview set", "--out", ("notes.txt", "absent/x/y.avi", "x" * 300)),
    "preview frames": ("preview set --out new.gif", "--frames", ("0", "-1")),
    "preview rate": ("preview set --out new.gif", "--fps", NUMBERS),
    "validate": ("validate {}", "", DATA_SETS),
    "validate camera": ("validate set", "--camera", (*PLACES, "empty", "latin.txt")),
    "export": ("export {} --to tum --out new", "", DATA_SETS),
    "export out": ("export set --to colmap", "--out", OUTS),
    "export camera": ("export set --to tum --out new", "--camera", (*PLACES, "latin.txt")),
    "localize model": ("localize {} photos", "", (*PLACES, *TEXTS, "set", "room.glb")),
    "localize images": ("localize model.pt {}", "", (*PLACES, "empty", "set", "latin.txt")),
    "localize out": ("localize model.pt photos", "--out", (*OUTS[:7], "model.pt")),
    "plan profile": ("plan", "--profile", (*PLACES, "empty", "notes.txt", *CONFIGURATION_FILES)),
    "run profile": ("run", "--profile", (*CONFIGURATION_FILES, "x")),
    "run cores": ("run", "--cores", ("0", "-1")),
    "plan measured": ("plan", "--measured", (*PLACES[1:], "empty")),
    "plan cores": ("plan", "--cores", ("0", "-1")),
    "plan compare": ("plan", "--compare", (*PLACES[1:], "empty")),
    "compare": ("compare {} empty", "", DATA_SETS),
}


def make_folder(folder, mesh, data_set, model):
    """Files that are sound (room.glb, set, model.pt, photos), and others that are not."""
    shutil.copy(mesh, folder / "room.glb")
    shutil.copytree(data_set, folder / "set")
    shutil.copy(model, folder / "model.pt")
    (folder / "empty").mkdir()
    (folder / "photos").mkdir()
    Image.new("RGB", (40, 40), (9, 99, 199)).save(folder / "photos" / "a.png")
    (folder / "notes.txt").write_text("mine\n")
    (folder / "latin.txt").write_bytes(b"caf\xe9 0 0\n")
    (folder / "text.glb").write_text("no mesh")
    (folder / "cut.glb").write_bytes(mesh.read_bytes()[:500])
    (folder / "nothing.obj").write_text("# empty\n")
    (folder / "image.glb").write_bytes((folder / "photos" / "a.png").read_bytes())
    for name, content in FILES.items():
        (folder / name).write_bytes(content)
    (folder / "folder.yaml").mkdir()
    (folder / "loop.yaml").symlink_to("loop.yaml")
    (folder / "loop").symlink_to("loop")


def arguments_of(name, value):
    """Return the words typed for a row of the table."""
    command, option, _ = TABLE[name]
    words = [value if word == "{}" else word for word in command.split()]
    if not option:
        return words
    if option in words:
        place = words.index(option)
        words[place : place + 2] = []
    return [*words, f"{option}={value}"]
