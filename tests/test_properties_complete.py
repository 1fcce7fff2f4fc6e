"""Every public function of geometry, planning, labels and pose graphs has a property test."""

from __future__ import annotations

import inspect
import pkgutil
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType
from typing import Any

import pytest
from hypothesis import is_hypothesis_test

from tests import (
    test_properties_coverage,
    test_properties_geometry,
    test_properties_groundtruth,
    test_properties_label_error,
    test_properties_paths,
    test_properties_planning,
    test_properties_posegraph,
)

PACKAGES = ("synfeal.geometry", "synfeal.labels", "synfeal.planning")
GROUNDTRUTH = ("batches", "chain", "label_error", "label_set", "trajectory")
POSE_GRAPHS = ("graph", "lm", "optimise", "toro")
TESTS = (
    test_properties_coverage,
    test_properties_geometry,
    test_properties_groundtruth,
    test_properties_label_error,
    test_properties_paths,
    test_properties_planning,
    test_properties_posegraph,
)


def modules() -> list[ModuleType]:
    packages = [import_module(name) for name in PACKAGES]
    names = [
        f"{p.__name__}.{info.name}" for p in packages for info in pkgutil.iter_modules(p.__path__)
    ]
    names += [f"baselines.groundtruth.{name}" for name in GROUNDTRUTH]
    names += [f"baselines.groundtruth.posegraph.{name}" for name in POSE_GRAPHS]
    return [import_module(name) for name in names]


def public_functions(module: ModuleType) -> Iterator[Any]:
    """Functions of a module, methods and properties of its classes; nothing that begins with _."""
    for name, value in vars(module).items():
        if name.startswith("_") or getattr(value, "__module__", None) != module.__name__:
            continue
        if inspect.isfunction(value):
            yield value
        elif inspect.isclass(value):
            members = [v for n, v in vars(value).items() if not n.startswith("_")]
            yield from (v for v in members if inspect.isfunction(v) or isinstance(v, property))


def name_of(function: Any) -> str:
    function = function.fget if isinstance(function, property) else function
    return f"{function.__module__}.{function.__qualname__}"


FUNCTIONS = {name_of(f): f for module in modules() for f in public_functions(module)}
PROPERTIES = [t for tests in TESTS for t in vars(tests).values() if hasattr(t, "about")]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_public_function_has_a_property_test(name: str) -> None:
    assert any(FUNCTIONS[name] in test.about for test in PROPERTIES)


def test_properties_are_drawn_by_hypothesis_and_are_about_public_functions() -> None:
    assert all(is_hypothesis_test(test) for test in PROPERTIES)
    named = {name_of(function) for test in PROPERTIES for function in test.about}
    assert named == set(FUNCTIONS)
