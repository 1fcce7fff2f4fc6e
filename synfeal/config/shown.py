"""Names and defaults of configuration fields as help and docstrings show them."""

from __future__ import annotations

from typing import NamedTuple

from pydantic.fields import FieldInfo


class Shown(NamedTuple):
    """Words for a field in help, where its type and default do not say enough.

    Attributes:
        values: Names of its values.
        default: Its default in words, where that depends on other fields.
    """

    values: tuple[str, ...] = ()
    default: str | None = None


def default_text(field: FieldInfo) -> str:
    """Return the default of a field as it is typed; nothing for switches and without one."""
    value = field.get_default()
    if field.is_required() or isinstance(value, bool) or value is None or value == ():
        return ""
    if isinstance(value, tuple):
        return " ".join(f"{each:g}" for each in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
