"""Choice of the pairs that are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Choice:
    """Bounds of what is kept.

    Attributes:
        min_overlap: Least overlap; of the two directions the smaller one counts.
        max_overlap: Greatest overlap, likewise: leaves out frames that are nearly the same.
        per_frame: Most pairs that a frame is in; those that overlap most are kept. None: all.
    """

    min_overlap: float = 0.1
    max_overlap: float = 1.0
    per_frame: int | None = None

    def rows(
        self,
        first: NDArray[np.int64],
        second: NDArray[np.int64],
        overlap_ab: NDArray[np.float32],
        overlap_ba: NDArray[np.float32],
    ) -> NDArray[np.int64]:
        """Choose rows of a table of pairs.

        Args:
            first: Frame a (P,) of each pair.
            second: Frame b (P,).
            overlap_ab: Overlap (P,) of a with b.
            overlap_ba: Overlap (P,) of b with a.

        Returns:
            Rows (K,), in order.
        """
        smaller = np.minimum(overlap_ab, overlap_ba)
        kept = np.flatnonzero((smaller >= self.min_overlap) & (smaller <= self.max_overlap))
        if self.per_frame is None:
            return kept
        n_pairs = np.zeros(1 + max(first.max(initial=0), second.max(initial=0)), np.int64)
        chosen = []
        for row in kept[np.argsort(-smaller[kept], kind="stable")].tolist():
            a, b = first[row], second[row]
            if n_pairs[a] < self.per_frame and n_pairs[b] < self.per_frame:
                n_pairs[[a, b]] += 1
                chosen.append(row)
        return np.sort(np.array(chosen, np.int64))
