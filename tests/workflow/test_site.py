"""The documentation site: what its reference covers, and what its check notices."""

import inspect
import re
import sys

import pytest

import synfeal
from tests import ROOT


@pytest.fixture
def site_module(monkeypatch):
    """Import a module of docs/site, which is no package."""
    monkeypatch.syspath_prepend(str(ROOT / "docs/site"))

    def load(name):
        sys.modules.pop(name, None)
        return __import__(name)

    return load


def write(folder, pages):
    for name, links in pages.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        body = "".join(f'<a href="{link}">there</a>' for link in links)
        path.write_text(f'<html><h1 id="top">Title</h1>{body}</html>', encoding="utf-8")
    return folder


WHOLE = {
    "docs/index.html": ["reference/commands.html", "reference/api.html?v=1#top", "https://a.org/x"],
    "docs/reference/commands.html": ["commands/collect.html"],
    "docs/reference/commands/collect.html": ["../../index.html"],
    "docs/reference/api.html": ["api/synfeal.collect.html"],
    "docs/reference/api/synfeal.collect.html": [],
}


def problems_of(site_module, folder, **changes):
    pages = WHOLE | {name.replace("__", "/") + ".html": links for name, links in changes.items()}
    site = write(folder, pages)
    return site_module("check").problems(site.resolve(), ["collect"], ["synfeal.collect"])


def test_a_whole_site_has_no_problems(site_module, tmp_path):
    assert problems_of(site_module, tmp_path) == []


@pytest.mark.parametrize(
    ("link", "problem"),
    [
        ("gone.html", "docs/index.html: docs/gone.html is not there"),
        ("reference/api.html#gone", "docs/index.html: docs/reference/api.html has no #gone"),
    ],
)
def test_a_broken_link_is_named(site_module, tmp_path, link, problem):
    found = problems_of(site_module, tmp_path, docs__index=[*WHOLE["docs/index.html"], link])
    assert found == [problem]


def test_a_command_three_clicks_away_is_named(site_module, tmp_path):
    between = {"docs__reference__commands": ["../between.html"]}
    found = problems_of(
        site_module, tmp_path, docs__between=["reference/commands/collect.html"], **between
    )
    assert found == ["docs/reference/commands/collect.html is 3 clicks from the start"]


def test_a_page_nobody_links_to_and_a_missing_function_are_named(site_module, tmp_path):
    site = write(tmp_path, WHOLE | {"docs/lost.html": []}).resolve()
    found = site_module("check").problems(site, ["collect"], ["synfeal.collect", "synfeal.gone"])
    assert found == ["docs/lost.html is not reached", "synfeal.gone has no page"]


def test_every_command_has_a_page_with_every_option(site_module):
    reference = site_module("reference")
    pages = reference.command_pages()
    parsers = reference.command_parsers()
    assert len(parsers) >= 14
    for name, parser in parsers.items():
        page = pages[f"commands/{name}.rst"]
        flags = {flag for action in parser._actions for flag in action.option_strings}
        missing = {flag for flag in flags - {"-h", "--help"} if f"``{flag}" not in page}
        assert not missing, name


def test_every_public_name_has_a_page_and_every_summary_a_sentence(site_module):
    pages = site_module("reference").function_pages()
    assert {f"api/synfeal.{name}.rst" for name in synfeal.__all__} == pages.keys() - {"api.rst"}
    for name in synfeal.__all__:
        assert inspect.getdoc(getattr(synfeal, name)), name


def test_pages_of_what_is_gone_are_removed_and_others_left_alone(
    site_module, tmp_path, monkeypatch
):
    reference = site_module("reference")
    monkeypatch.setattr(reference, "command_pages", lambda: {"a.rst": "a", "b.rst": "b"})
    monkeypatch.setattr(reference, "function_pages", dict)
    monkeypatch.setattr(reference, "module_pages", dict)
    reference.write_pages(tmp_path)
    before = (tmp_path / "a.rst").stat().st_mtime_ns
    monkeypatch.setattr(reference, "command_pages", lambda: {"a.rst": "a"})
    reference.write_pages(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["a.rst"]
    assert (tmp_path / "a.rst").stat().st_mtime_ns == before


def test_the_contents_name_pages_that_there_are():
    """Sphinx notices, but the site is built less often than tests are run."""
    folder = ROOT / "docs"
    blocks = re.findall(r"```\{toctree\}(.*?)```", (folder / "index.md").read_text(), re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if line]
    entries = [line for line in lines if not line.startswith(":")]
    names = [re.sub(r".*<(.+)>", r"\1", entry) for entry in entries]
    written = [name for name in names if not name.startswith("reference/")]
    assert len(written) > 20
    for name in written:
        assert any((folder / f"{name}{end}").is_file() for end in (".md", ".ipynb")), name
