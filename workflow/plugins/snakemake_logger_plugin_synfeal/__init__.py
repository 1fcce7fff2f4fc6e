"""Shows a run as a person wants to see it.

``synfeal run`` calls it: ``PYTHONPATH=workflow/plugins snakemake --logger synfeal --cores 2 all``.

Everything that Snakemake says is in its own log file; here it says what went wrong and no more.
A dry run (``-n``) prints the jobs that a run would do.
"""

import sys
from logging import WARNING, Handler, LogRecord
from pathlib import Path

from rich.console import Console
from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from reproduction.plan.dry_run import job_name
from reproduction.plan.planned import planned_text
from reproduction.plan.view import RunView

SAID = ("Nothing to be done", "Complete log")


class LogHandler(LogHandlerBase):
    """Hands the events of a run to its view."""

    writes_to_stream = True
    writes_to_file = False
    has_filter = True
    has_formatter = False
    needs_rulegraph = False

    def __post_init__(self) -> None:
        """Before any event."""
        Handler.__init__(self)  # the interface of Snakemake 9.0 leaves that out
        self.view = RunView(Console(stderr=True, no_color=self.common_settings.nocolor or None))
        self.jobs: dict[int, tuple[str, list[Path]]] = {}
        self.planned: list[str] = []  # of a dry run: names of its jobs
        self.counts: dict[str, int] = {}  # jobs that are to run, by rule

    def emit(self, record: LogRecord) -> None:
        """Called for one event after the other, in one thread."""
        try:
            self._show(record)
        except Exception:  # noqa: BLE001
            # As logging asks of handlers: it prints the traceback, and the run goes on
            # (https://docs.python.org/3/library/logging.html#logging.Handler.handleError).
            self.handleError(record)

    def close(self) -> None:
        """After all events."""
        self.view.end()
        planned, self.planned = self.planned, []  # logging closes its handlers more than once
        if planned:
            sys.stdout.write(planned_text(planned))
        super().close()

    def _show(self, record: LogRecord) -> None:
        fields = record.__dict__
        match fields.get("event"):
            case LogEvent.JOB_INFO if self.common_settings.dryrun:
                if fields["benchmark"]:  # targets are no work
                    self.planned.append(job_name(fields["benchmark"]))
            case LogEvent.JOB_INFO if fields["benchmark"]:
                job = job_name(fields["benchmark"])
                self.jobs[fields["jobid"]] = job, [Path(path) for path in fields["output"]]
                self.view.started(job)
            case LogEvent.JOB_FINISHED:
                self._finish(fields["job_id"])
            case LogEvent.PROGRESS:
                self.view.progress(fields["done"], fields["total"])
            case LogEvent.JOB_ERROR:
                job = self._finish(fields["jobid"])
                self.view.failed(job or fields["rule_name"], map(Path, fields["log"]))
            case LogEvent.RUN_INFO:
                self.counts = dict(fields["stats"])
            case _ if "plan" in fields:  # of the Snakefile's `onstart`
                self.view.begin(fields["plan"](self.counts))
            case _ if record.levelno >= WARNING or record.getMessage().startswith(SAID):
                self.view.say(self.format(record))

    def _finish(self, jobid: int) -> str:
        job, outputs = self.jobs.pop(jobid, ("", []))
        if job:
            self.view.finished(job)
        for path in outputs:
            if path.name == "metrics.json" and path.exists():
                self.view.scored(path)
        return job
