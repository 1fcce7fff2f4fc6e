"""What the reproduction needs of every label method."""

from baselines.labels import methods
from baselines.labels.methods import METHODS
from reproduction.figures.style import METHOD_STYLES
from reproduction.tables.layouts import SOURCES
from tests import ROOT


def test_every_method_has_a_title_a_style_and_someone_who_runs_it():
    for name, method in METHODS.items():
        assert SOURCES[name] == method.title
        assert name in METHOD_STYLES
    own_rules = set(METHODS) - {*methods.frame_methods(), *methods.graph_methods()}
    assert own_rules == {"sfm"}
    rules = (ROOT / "workflow/rules/estimation.smk").read_text()
    assert all(f"rule {name}:" in rules for name in own_rules)
