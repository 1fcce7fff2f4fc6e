"""Kinds of values that every configuration is made of, and the model that all of them extend."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, ClassVar, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

# Names of directories below the results.
Slug = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_]*$", max_length=64)]
SizeName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_]+$", max_length=64)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, lt=1)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Count = Annotated[int, Field(ge=1, le=10**9)]
MOST_FRAMES = 10**7  # per split: four days at 30 frames/s; planning takes 1.3 GB
Finite = Annotated[float, Field(allow_inf_nan=False)]
Channel = Annotated[int, Field(ge=0, le=255)]


class Strict(BaseModel):
    """A model that refuses unknown keys and cannot be changed after it was checked."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    unless_none: ClassVar[tuple[str, ...]] = ()  # keys that came later: older records lack them

    @model_serializer(mode="wrap")
    def _without_absent(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        return {k: v for k, v in values.items() if v is not None or k not in self.unless_none}

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown(cls, values: Any) -> Any:
        keys = values if isinstance(values, dict) else ()
        if unknown := [k for k in keys if isinstance(k, str) and k not in cls.model_fields]:
            allowed = ", ".join(sorted(cls.model_fields))
            raise ValueError(f"{unknown[0] or repr('')}: unknown key; allowed here: {allowed}")
        return values

    @field_validator("*", mode="before")
    @classmethod
    def _refuse_coercion(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse true and false where a number is meant, and NUL, which no path can hold."""
        annotation = cls.model_fields[str(info.field_name)].annotation
        parts = value if isinstance(value, list | tuple) else [value]
        if isinstance(value, dict) and get_origin(annotation) is dict:  # else another model's keys
            parts = list(value.values())
        for part in parts:
            if isinstance(part, bool) and annotation is not bool:
                raise PydanticCustomError("no_number", "must not be true or false")
            if isinstance(part, str | Path) and "\0" in str(part):
                raise PydanticCustomError("no_text", "must not hold the character NUL")
        return value


def part(model: Callable[[], Any], description: str) -> Any:
    """Define a field that holds another model, all of whose keys have defaults."""
    return Field(default_factory=model, description=description)


def ordered(interval: tuple[float, float]) -> tuple[float, float]:
    """Check that the first of two bounds is below the second."""
    if not interval[0] < interval[1]:
        raise PydanticCustomError("order", "the first number must be below the second")
    return interval


Interval = Annotated[tuple[Finite, Finite], AfterValidator(ordered)]
