"""What localizes keeps linear algebra to one thread, and its caller's threads as they are."""

from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from baselines.references import localized, mapped, stated_errors
from synfeal.camera.photograph import PhotographCamera


class SeenError(Exception):
    """Ends what was called, with the threads that it had."""


def blas_threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def localize():
    localized.localize_in_map(Path("map"), [], Path("out"), camera=PhotographCamera())


@pytest.mark.parametrize(
    ("module", "first", "call"),
    [
        (localized, "read_map", localize),
        (mapped, "refuse_existing", lambda: mapped.build_map(None, Path("map"))),
        (stated_errors, "Finder", lambda: stated_errors.try_map(None, None, "", 0)),
    ],
)
def test_linear_algebra_has_one_thread(module, first, call, monkeypatch):
    def end(*_: object) -> None:
        raise SeenError(blas_threads())

    monkeypatch.setattr(module, first, end)
    np.linalg.svd(np.eye(3))
    with threadpool_limits(limits=2, user_api="blas"):
        assert blas_threads() == {2}
        with pytest.raises(SeenError) as seen:
            call()
        assert seen.value.args[0] == {1}
        assert blas_threads() == {2}
