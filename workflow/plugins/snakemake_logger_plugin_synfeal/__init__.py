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

from reproduction.plan.planned import planned_text
from reproduction.plan.progress import RunView, TimeLeft

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
        self.planned: list[str] = []  # names of the jobs of a dry run
        self.counts: dict[str, int] = {}  # jobs that are to run, by rule
        self.names: dict[int, str] = {}  # by number, names of jobs that began

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
                    self.planned.append(_job_name(fields["benchmark"]))
            case LogEvent.JOB_INFO:
                self.view.started(fields["jobid"], fields["rule_name"])
                if fields["benchmark"]:
                    self.names[fields["jobid"]] = _job_name(fields["benchmark"])
            case LogEvent.JOB_FINISHED:
                self.view.finished(fields["job_id"])
            case LogEvent.PROGRESS:
                self.view.progress(fields["done"], fields["total"])
            case LogEvent.JOB_ERROR:
                self.view.finished(fields["jobid"])
                name = self.names.get(fields["jobid"], fields["rule_name"])
                self.view.failed(name, map(Path, fields["log"]))
            case LogEvent.RUN_INFO:
                self.counts = {rule: n for rule, n in fields["stats"].items() if rule != "total"}
            case _ if "expected_s" in fields:  # from the Snakefile's `onstart`
                left = TimeLeft(self.counts, fields["expected_s"], fields["cores"])
                self.view.begin(left)
            case _ if record.levelno >= WARNING or record.getMessage().startswith(SAID):
                self.view.say(self.format(record))


def _job_name(benchmark: str) -> str:
    """Return ``stage/name`` of a job, from the file that measures it."""
    return benchmark.partition("/benchmarks/")[2].removesuffix(".tsv")
