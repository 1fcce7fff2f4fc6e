"""Error against size of image: networks of two sizes beside feature matching, on one data set.

    python -m benchmarks.image_size results results/benchmarks/image_size

reads ``results/image_size_<width>``, which :file:`benchmarks/profiles/image_size.yaml` says how to
make, ``results/benchmarks/gpu_errors.csv`` (:file:`benchmarks/gpu.sh`) and the reference methods of
the published ``night``, and writes a table and a picture. All are of the Large Room of ``night``,
6,000 training and 2,500 test frames. Those on which networks of :file:`gpu.sh` and structure at
sizes were tested are drawn with present code, whose test frames are spread over their paths.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from reproduction.figures.style import BLUE, RC, VERMILION
from reproduction.runs.scores import METRICS_FILE
from synfeal.records.files import read_json, writing
from synfeal.records.tables import write_frame
