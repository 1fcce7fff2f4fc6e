"""Jobs of rules, in processes of their own."""

import subprocess
import sys


def run_job(tmp_path, body):
    log = tmp_path / "job.log"
    script = (
        "import os, sys\nfrom synfeal.errors import InputError\n"
        "from reproduction.runs.job import job\n"
        f"with job({str(log)!r}):\n    print('spoken')\n    os.system('echo native')\n    {body}\n"
    )
    command = [sys.executable, "-c", script]
    return subprocess.run(command, capture_output=True, text=True, check=False)
