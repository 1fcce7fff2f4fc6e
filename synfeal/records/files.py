"""Files and directories that appear complete under their final names, or not at all."""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import re
import secrets
import shutil
import socket
import stat
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from synfeal.errors import Argument, InputError, file_of

# Names of what is being written begin so, then say by which process: nobody else's files do.
UNFINISHED = ".synfeal-unfinished"


def unfinished_prefix(name: str) -> str:
    """Begin the name of a temporary file or directory that will become ``name``."""
    host = re.sub(r"[^A-Za-z0-9.]", "_", socket.gethostname())
    return f"{UNFINISHED}-{host}-{os.getpid()}-{name}-"


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``, same suffix, renamed to it if the block succeeds.

    Where ``path`` is a link, it stays one, and the file that it leads to is written.

    Raises:
        OSError: it cannot be written; whatever the system calls the file, ``path`` is named.
    """
    path = _end_of_links(Path(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = _unfinished(path)
    try:
        temporary.open("xb").close()  # with the permissions that the user wants for new files
        yield temporary
        temporary.replace(path)
    except OSError as error:
        if error.filename in (None, str(temporary), temporary):
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _unfinished(path: Path) -> Path:
    """Choose a temporary name beside a file or directory, with the same suffix."""
    begin = unfinished_prefix(path.stem if path.suffix else path.name)
    return path.with_name(f"{begin}{secrets.token_hex(4)}{path.suffix}")


def _end_of_links(path: Path) -> Path:
    """Return where a link leads, so that the link stays and what it leads to is written.

    Raises:
        OSError: Links lead in a circle, or to a pipe or a device, which cannot be replaced.
    """
    end = Path(os.path.realpath(path)) if path.is_symlink() else path
    if end.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EINVAL, "Is a pipe or a device, not a file", str(path))
    return end


MOST_TEXT_BYTES = 2**29  # more than poses of a million frames take
MOST_YAML_BYTES = 2**20  # settings and calibrations; a megabyte takes seconds to parse


def read_text(path: Path, encoding: str = "utf-8", most_bytes: int = MOST_TEXT_BYTES) -> str:
    """Read a text file as a whole.

    Pipes and devices are not read: they may never end, or never begin.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is no regular file, larger than ``most_bytes``, or not text.
    """
    return text_of(read_bytes(path, most_bytes), encoding)


def text_of(content: bytes, encoding: str = "utf-8") -> str:
    """Decode the bytes of a text file.

    Raises:
        ValueError: They are not text.
    """
    text = content.decode(encoding)
    if "\0" in text:
        raise ValueError("it holds zero bytes, so it is no text")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_bytes(path: Path, most_bytes: int) -> bytes:
    """Read a file as a whole.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is a pipe or a device, or larger than ``most_bytes``.
    """
    status = path.stat()
    if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
        raise ValueError("it is a pipe or a device, which may never end; copy it to a file")
    if status.st_size > most_bytes:
        size_mb, most_mb = status.st_size / 1e6, most_bytes / 1e6
        raise ValueError(f"it has {size_mb:.0f} MB, and more than {most_mb:.3g} MB are not read")
    return path.read_bytes()  # the system says what is wrong with a directory


def read_json(path: Path) -> Any:
    """Read a JSON file and refuse numbers that are not finite.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is not UTF-8, not JSON, or nested too deeply.
    """
    try:
        text = read_text(path)
        return json.loads(text, parse_constant=_finite, parse_float=_finite, parse_int=_whole)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error


def _finite(text: str) -> float:
    if not math.isfinite(float(text)):
        raise ValueError(f"{text[:20]} is not a finite number")
    return float(text)


def _whole(text: str) -> int:
    _finite(text)
    return int(text)


def dotted(record: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Flatten nested mappings, joining their keys by dots."""
    flat: dict[str, Any] = {}
    for key, value in record.items():
        inner = dotted(value, f"{prefix}{key}.") if isinstance(value, Mapping) else None
        flat |= {f"{prefix}{key}": value} if inner is None else inner
    return flat


def write_json(path: Path, value: Any) -> None:
    """Write ``value`` as indented JSON with sorted keys; NaN is refused."""
    write_text(path, json.dumps(value, indent=2, sort_keys=True, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a file as a whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def file_sha256(path: Path) -> str:
    """Hash a file by SHA-256."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def lies_in(path: Path, folder: Path) -> bool:
    """Check whether a path leads to a place in a folder, links followed."""
    # Not Path.resolve, which raises where links form a circle.
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def names_below(name: str) -> bool:
    """Check whether a name leads below the folder it starts in; links there are its owner's."""
    return not Path(name).is_absolute() and ".." not in Path(name).parts


def refuse_inside(out: Path, dataset: Path) -> None:
    """Refuse to write into a data set itself, whose files would no longer be its own."""
    if lies_in(out, dataset):
        raise InputError(
            Argument("out"),
            f"{out} lies in the data set {dataset} itself",
            "choose a place beside it",
        )


def refuse_unwritable(out: Path) -> None:
    """Refuse a file or folder that could not be written, before the work for it is done.

    Args:
        out: File or folder that is to be written; folders that it lies in are made then.

    Raises:
        InputError: Nothing can be written there.
    """
    remedy = "choose another place with `out`"
    try:
        end = _end_of_links(out)
        end.lstat()
    except FileNotFoundError:
        pass
    except OSError as error:
        raise InputError(out, str(error.strerror), remedy) from error
    place = end.parent
    while not os.path.lexists(place):
        place = place.parent
    try:
        probe = _unfinished(place / "probe")
        probe.open("xb").close()
        probe.unlink()
    except OSError as error:
        raise InputError(out, f"cannot be written, {place}: {error.strerror}", remedy) from error


def refuse_existing(path: Path) -> None:
    """Refuse to write where there is something already."""
    if path.is_symlink() and not path.exists():
        raise InputError(path, "is a link that leads nowhere", "choose another directory")
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise InputError(path, "exists and is not empty", "delete it or choose another directory")


def refuse_foreign(out: Path, own: Collection[str], origin: str) -> None:
    """Refuse a directory with anything but what an earlier command of the same kind wrote.

    So is one that could not be written.

    Args:
        out: Directory to write into, which need not exist.
        own: Names of the files that may be replaced.
        origin: What writes them, for messages, as in "is not from a comparison".
    """
    if os.path.lexists(out) and not out.is_dir():
        raise InputError(out, "is a file", "choose another directory with `out`")
    names = sorted(path.name for path in out.glob("*"))
    others = [name for name in names if name not in own and not name.startswith(UNFINISHED)]
    if others:
        raise InputError(
            out,
            f"holds '{others[0]}', which is not from {origin}",
            "choose another directory with `out`",
        )
    refuse_unwritable(out / min(own))


@contextmanager
def writing_to(path: Path, remedy: Callable[[], str]) -> Iterator[None]:
    """Say in one line that a file could not be written: a full disk, a read-only one.

    In place of any ``OSError``; names ``path`` where the system names no file, and what to do then.

    Raises:
        InputError: The block raised an ``OSError``.
    """
    try:
        yield
    except OSError as error:
        name, reason = file_of(error) or path, error.strerror or str(error)
        raise InputError(name, reason, remedy()) from error


@contextmanager
def atomic_directory(path: Path, *, replace: bool = False) -> Iterator[Path]:
    """Yield a temporary directory beside ``path`` that takes its name if the block succeeds.

    Args:
        path: The directory to be made.
        replace: Replace a directory that is already there. It keeps its name until the new one is
            complete, and gets it back if the new one cannot take it; both renames follow each
            other immediately.

    Raises:
        InputError: ``path`` is not empty, and not to be replaced.
        OSError: The directory cannot be written.
    """
    if not replace:
        refuse_existing(Path(path))
    path = _end_of_links(Path(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = _unfinished(path)
    temporary.mkdir()
    former = temporary.with_name(f"{temporary.name}-former")
    try:
        yield temporary
        if replace and path.exists():
            path.rename(former)
        try:
            temporary.replace(path)
        except OSError:
            if former.exists():
                former.rename(path)
            raise
        shutil.rmtree(former, ignore_errors=True)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


class PlainLoader(yaml.SafeLoader):
    """YAML that builds nothing but plain values, each key once, and without aliases.

    A few lines of aliases can stand for gigabytes.
    """

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node; refuse an alias."""
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, "aliases (*name) are not read", mark)
        return super().compose_node(parent, index)

    def construct_yaml_int(self, node: Any) -> int:
        """Construct a whole number; refuse what YAML 1.1 alone takes for octal or base 60."""
        text = str(self.construct_scalar(node)).lstrip("+-")
        if ":" in text or (len(text) > 1 and text[0] == "0" and text[1] in "01234567_"):
            raise yaml.constructor.ConstructorError(
                None,
                None,
                f"'{text}' would be read as another number; write it without a 0 or ':' in front",
                node.start_mark,
            )
        return super().construct_yaml_int(node)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """Construct a mapping; refuse a key that occurs twice."""
        keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for place, key in enumerate(keys):
            if key in keys[:place]:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key '{key}' is there twice", node.start_mark
                )
        return super().construct_mapping(node, deep)


PlainLoader.add_constructor("tag:yaml.org,2002:int", PlainLoader.construct_yaml_int)
