"""Files of named arrays."""

import errno

import numpy as np
import pytest

from baselines.references.arrays import read_arrays, write_arrays
from tests.support.small_disk import mounted


@pytest.mark.parametrize("n_bytes", [100, 10**6])
def test_a_full_disk_is_told_as_one(tmp_path, n_bytes):
    with mounted(tmp_path / "disk", "64k") as disk:
        path = disk / "arrays.npz"
        write_arrays(path, {"few": np.arange(5)})
        (disk / "rest").write_bytes(bytes(2**15))
        arrays = {"many": np.zeros(10**6, np.uint8), "more": np.zeros(n_bytes, np.uint8)}
        with pytest.raises(OSError, match="No space left on device") as raised:
            write_arrays(path, arrays)
        assert (raised.value.errno, raised.value.filename) == (errno.ENOSPC, str(path))
        np.testing.assert_array_equal(read_arrays(path, ["few"])["few"], np.arange(5))
        assert sorted(each.name for each in disk.iterdir()) == ["arrays.npz", "rest"]
