"""Names of settings as flags of the command line."""

from __future__ import annotations

from pydantic import BaseModel

# Units that names in Python end in. Flags leave them out, for the help shows them.
UNITS = {"m": "M", "m2": "M2", "deg": "DEG", "px": "PX", "hz": "HZ", "s": "S", "rgb": ""}


def flag_of(name: str) -> str:
    """Return the flag of a setting: its name without the unit at its end."""
    stem, _, unit = name.rpartition("_")
    return f"--{(stem if stem and unit in UNITS else name).replace('_', '-')}"


def as_options(config: BaseModel) -> list[str]:
    """Write the settings that are not their defaults as arguments of a command.

    Args:
        config: Settings; a field with the default value is left out, a required one is an option.
    """
    words: list[str] = []
    for name, field in type(config).model_fields.items():
        value = getattr(config, name)
        if not field.is_required() and value == field.get_default(call_default_factory=True):
            continue
        if value is True:
            words.append(flag_of(name))
            continue
        several = isinstance(value, tuple) and value and isinstance(value[0], tuple)
        for each in value if several else [value]:
            parts = each if isinstance(each, tuple) else [each]
            shown = [f"{part:g}" if isinstance(part, float) else str(part) for part in parts]
            words += [flag_of(name), *shown]
    return words
