"""Jobs of a run that begins with nothing, as Snakemake tells them: the records of its plugins.

``python -m tests.support.dry_run PROFILE RESULTS OUT`` writes them: Snakemake takes over logging
and the working directory of its process.
"""

import json
import logging
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from snakemake.api import SnakemakeApi
from snakemake.logging import logger
from snakemake.settings.types import (
    ConfigSettings,
    DAGSettings,
    OutputSettings,
    ResourceSettings,
    StorageSettings,
)
from snakemake_interface_logger_plugins.common import LogEvent

from tests import ROOT


@cache
def measured_jobs(profile):
    """Names of the jobs of a profile by rule, as below ``<root>/benchmarks``."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / "jobs.json"
        command = [sys.executable, "-m", __name__, f"config/{profile}.yaml", folder, str(out)]
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
        records = json.loads(out.read_text())
    names = {}
    for record in records:
        if record["benchmark"]:
            name = record["benchmark"].partition("/benchmarks/")[2].removesuffix(".tsv")
            names.setdefault(record["rule"], set()).add(name)
    return names


def dry_run(profile, results, out):
    """Write the records of all jobs."""
    records = []

    class Keep(logging.Handler):
        def emit(self, record):
            said = record.__dict__
            if said.get("event") == LogEvent.JOB_INFO:
                kept = {name: said[name] for name in ("benchmark", "input", "output")}
                asked = said["resources"].get("gpu_percent", 0)
                records.append({"rule": said["rule_name"], "gpu_percent": asked, **kept})

    with SnakemakeApi(OutputSettings(dryrun=True)) as api:
        workflow = api.workflow(
            resource_settings=ResourceSettings(cores=1),
            config_settings=ConfigSettings(config={"results": results}, configfiles=[profile]),
            storage_settings=StorageSettings(),
            snakefile=Path("Snakefile"),
        )
        dag = workflow.dag(DAGSettings(targets={"all"}, forceall=True))
        logger.addHandler(Keep())
        dag.execute_workflow(executor="dryrun")
    out.write_text(json.dumps(records, default=str))


if __name__ == "__main__":
    dry_run(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
