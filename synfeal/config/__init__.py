"""Configuration: typed models, reading, and the table of experiments."""

from synfeal.config.experiments import Design, Experiment, Run, read_design, read_experiments
from synfeal.config.load import check_mesh_files, load_config, parse_config
from synfeal.config.models import MODELS, Config
