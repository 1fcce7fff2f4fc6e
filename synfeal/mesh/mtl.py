"""The text of MTL files: colour, opacity and texture of materials.

After "Material Library File (.mtl)" (Wavefront, 1995), and what programs write that differs.
Statements about light, which an unlit image does not show, are passed over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from synfeal.mesh.obj_text import BLANKS, joined
from synfeal.mesh.text_rows import decoded

# Options of textures: how many numbers may follow, and how many must.
OPTIONS = {"-o": (3, 1), "-s": (3, 1), "-t": (3, 1), "-mm": (2, 2), "-texres": (2, 1)}
OPTIONS |= {"-boost": (1, 1), "-bm": (1, 1)}
WORDS = {"-clamp", "-blendu", "-blendv", "-cc", "-imfchan", "-type", "-colorspace"}  # one follows
WITHOUT_EFFECT = {"-blendu", "-blendv", "-boost", "-texres", "-bm", "-type", "-cc", "-colorspace"}
OPAQUE_FROM = 0.999  # of Tr: written as 1.000000


@dataclass(frozen=True)
class TextureMap:
    """A texture as a material names it.

    Attributes:
        name: File.
        offset: Added to texture coordinates, after scaling.
        scale: Multiplies texture coordinates.
        is_clamped: Whether its edge shows beyond 0 and 1, instead of the texture again.
        base: Added to colours, 0 to 1.
        gain: Multiplies colours.
        unread: Options that are not followed.
    """

    name: str
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    is_clamped: bool = False
    base: float = 0.0
    gain: float = 1.0
    unread: tuple[str, ...] = ()


@dataclass(frozen=True)
class MtlMaterial:
    """A material of an MTL file.

    Attributes:
        name: As ``newmtl`` has it.
        diffuse: Its ``Kd``, 0 to 1 as a display shows it; None if it has none.
        dissolve: Its ``d``, 1 for opaque; None if it has none.
        transparency: Its ``Tr``; None if it has none.
        texture: Its ``map_Kd``.
        other_texture: Another texture that may hold its colour, by the keyword it stands behind.
        opacity: Its ``map_d``.
        unread: What it says of its colour that is not followed.
    """

    name: str
    diffuse: tuple[float, float, float] | None = None
    dissolve: float | None = None
    transparency: float | None = None
    texture: TextureMap | None = None
    other_texture: tuple[str, TextureMap] | None = None
    opacity: TextureMap | None = None
    unread: tuple[str, ...] = ()


@dataclass
class _Lines:
    materials: list[MtlMaterial] = field(default_factory=list)

    def set(self, **values: object) -> None:
        """Change the material that is being read."""
        self.materials[-1] = replace(self.materials[-1], **values)  # type: ignore[arg-type]

    def leave(self, what: str) -> None:
        """Remember what is not followed."""
        self.set(unread=(*self.materials[-1].unread, what))


def parse_mtl(content: bytes) -> list[MtlMaterial]:
    """Read the materials of an MTL file, in order."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        content = content.decode("utf-16", errors="replace").encode()
    text = content.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").translate(BLANKS)
    found = _Lines()
    for line in decoded(joined(text)).split("\n"):
        keyword, _, rest = line.strip().partition(" ")
        rest = rest.strip()
        if keyword.lower() == "newmtl":
            found.materials.append(MtlMaterial(rest))
        elif found.materials:
            _read_statement(found, keyword.lower(), rest)
    return found.materials


def _read_statement(found: _Lines, keyword: str, rest: str) -> None:
    if keyword == "kd":
        color = _numbers(rest)
        if len(color) == 2 or not color:  # ``spectral`` and ``xyz`` among others
            found.leave(f"Kd {rest}")
        else:
            red, green, blue = (color * 3)[:3] if len(color) == 1 else color[:3]
            found.set(diffuse=(red, green, blue))
    elif keyword == "d":
        value = _numbers(rest.removeprefix("-halo"))
        found.set(dissolve=value[0]) if value else found.leave(f"d {rest}")
    elif keyword == "tr":
        value = _numbers(rest)
        found.set(transparency=value[0]) if value else found.leave(f"Tr {rest}")
    elif keyword in ("map_kd", "map_ka", "map_ke", "map_d"):
        texture = parse_texture(rest)
        if texture is None:
            found.leave(f"{keyword} without a file")
        elif keyword == "map_kd":
            found.set(texture=texture)
        elif keyword == "map_d":
            found.set(opacity=texture)
        elif found.materials[-1].other_texture is None:
            found.set(other_texture=(f"map_{keyword[4].upper()}{keyword[5]}", texture))
    elif keyword == "decal":
        found.leave("decal")


def _numbers(text: str) -> list[float]:
    """Return the numbers a text begins with."""
    found: list[float] = []
    for word in text.split():
        value = _number(word)
        if value is None:
            break
        found.append(value)
    return found


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def parse_texture(text: str) -> TextureMap | None:
    """Read options and the file's name, which may have blanks; None if there is no name."""
    values: dict[str, list[float]] = {}
    words: dict[str, str] = {}
    rest = text.strip()
    while rest.startswith("-"):
        option, _, behind = rest.partition(" ")
        option, behind = option.lower(), behind.strip()
        if option in OPTIONS:
            most, least = OPTIONS[option]
            found = _numbers(behind)[:most]
            if len(found) < least:
                break
            values[option] = found
            for _ in found:
                behind = behind.partition(" ")[2].strip()
        elif option in WORDS:
            words[option], _, behind = behind.partition(" ")
        else:
            break  # a name that begins with a dash
        rest = behind.strip()
    name = rest.strip().strip('"')
    if not name:
        return None
    base, gain = values.get("-mm", [0.0, 1.0])
    left = [option for option in (*values, *words) if option not in WITHOUT_EFFECT]
    followed = ("-o", "-s", "-mm", "-clamp")
    return TextureMap(
        name=name,
        offset=_pair(values.get("-o", []), 0.0),
        scale=_pair(values.get("-s", []), 1.0),
        is_clamped=words.get("-clamp", "").lower() == "on",
        base=base,
        gain=gain,
        unread=tuple(option for option in left if option not in followed),
    )


def _pair(values: list[float], default: float) -> tuple[float, float]:
    u, v, *_ = [*values, default, default]
    return u, v


def opaque_by_tr(materials: Sequence[MtlMaterial]) -> set[str]:
    """Name the materials whose ``Tr 1`` means opaque, as MeshLab and OpenMVS wrote it.

    The specification has it mean that nothing is seen. Nobody exports a scan of which nothing is
    seen, nor paints what is not: so it is opaque where the material has a texture, and where every
    material of the file without a ``d`` says the same.
    """
    undecided = [material for material in materials if material.dissolve is None]
    say_so = [m for m in undecided if (m.transparency or 0.0) >= OPAQUE_FROM]
    all_say_so = len(say_so) == len(undecided)
    return {m.name for m in say_so if all_say_so or m.texture is not None}
