"""Commands and functions have one name and the same words; those of the version before warn."""

import inspect
import pydoc
from pkgutil import resolve_name

import pytest

import synfeal
from synfeal.api import CollectOptions, ViewOptions
from synfeal.cli import main
from synfeal.cli.options import destination
from synfeal.cli.parser import (
    DISTRIBUTIONS,
    OWN_COMMANDS,
    all_commands,
    refuse_absent,
)
from synfeal.config.collect import CollectConfig, LikeConfig, ViewConfig
from synfeal.config.flags import as_options, flag_of
from synfeal.errors import InputError
from tests.support.collected import save_room

COMMANDS = {command.name: command for command in all_commands()}
CALLED = {name: command for name, command in COMMANDS.items() if command.function}


@pytest.fixture
def room(tmp_path):
    return save_room(tmp_path / "room.glb")


def test_every_command_about_data_is_a_function():
    assert {"collect", "plan", "scan", "inspect", "export", "validate", "preview"} <= set(CALLED)
    assert {"pairs", "evaluate", "unpack", "train", "localize", "map"} <= set(CALLED)


def test_a_command_that_is_not_installed_is_refused_with_where_it_comes_from():
    """Each that a package beside the simulator adds, by the package that has it."""
    named = {name: of for of, names in DISTRIBUTIONS.items() for name in names}
    added = set(COMMANDS) - {command.name for command in OWN_COMMANDS}
    assert added == set(named)
    for name, distribution in named.items():
        package = COMMANDS[name].action.__module__.partition(".")[0]
        assert distribution == f"synfeal-{package}"
        with pytest.raises(InputError, match=f"synfeal {name}: .* pip install {distribution}"):
            refuse_absent([name, "--help"], OWN_COMMANDS)
    refuse_absent(["build"], list(COMMANDS.values()))
    refuse_absent(["frobnicate"], OWN_COMMANDS)


@pytest.mark.parametrize("name", CALLED)
def test_a_command_and_its_function_have_the_same_words(name):
    function = getattr(synfeal, name)
    assert function is resolve_name(CALLED[name].function)
    takes = set(inspect.signature(function).parameters)
    options = {destination(flag, details) for flag, details in CALLED[name].options}
    # `plan` returns its poses, `validate` prints what it returns
    assert options - {"out"} == takes - {"out"}


@pytest.mark.parametrize("name", CALLED)
def test_a_flag_is_the_name_in_python_without_its_unit(name):
    for flag, details in CALLED[name].options:
        if flag.startswith("-"):
            assert flag == flag_of(destination(flag, details))


def test_keywords_are_the_fields_of_the_configuration():
    fields = {**CollectConfig.model_fields, **LikeConfig.model_fields}
    assert set(CollectOptions.__annotations__) == set(fields) - {"mesh", "frames"}
    assert set(ViewOptions.__annotations__) == set(ViewConfig.model_fields)


@pytest.mark.parametrize(
    ("function", "models"),
    [
        (synfeal.collect, (CollectConfig, LikeConfig)),
        (synfeal.plan, (CollectConfig, LikeConfig)),
        (synfeal.Renderer.__init__, (ViewConfig,)),
    ],
)
def test_help_shows_every_option_with_type_unit_and_default(function, models):
    takes, text = inspect.signature(function).parameters, pydoc.render_doc(function)
    for name, field in (item for model in models for item in model.model_fields.items()):
        assert name in takes
        assert f"{name}: " in text
        if not field.is_required():
            assert takes[name].default == field.default
            assert takes[name].kind is inspect.Parameter.KEYWORD_ONLY
    assert "options" not in takes
    assert "background_rgb: 'tuple[int, int, int]' = (0, 0, 0)" in text
    if function is not synfeal.Renderer.__init__:
        assert "spacing_m: Distance between frames, metres; default 0.03." in text


def test_settings_as_options_are_read_again_as_the_same_settings(room):
    boxes = ((-1.0, 1.0, -2.0, 0.5, 0.0, 1.0), (1.0, 2.0, 1.0, 2.0, -1.0, 1.0))
    config = CollectConfig(mesh=room, frames=30, spacing_m=0.25, box=boxes, yaw_deg=(-10, 20))
    words = as_options(config)
    read = {"mesh": room, "frames": 30, "spacing_m": 0.25, "box": boxes, "yaw_deg": (-10.0, 20.0)}
    assert words[:2] == ["--mesh", str(room)]
    assert words.count("--box") == 2
    typed = ["plan", str(room), *words[2:], "--out", str(room.parent / "poses.csv")]
    assert main(typed) == 0
    assert len((room.parent / "poses.csv").read_text().splitlines()) == 31
    assert CollectConfig(**read) == config


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"spacing_m": 0}, "spacing_m: must be 0.0001 or more, found 0"),
        ({"spacing_m": True}, "spacing_m: must not be true or false"),
        ({"box": [(1, 0, 0, 1, 0, 1)]}, "box: x: the first number must be below the second"),
        ({"fov_deg": 175}, "fov_deg: must be below 170"),
        ({"pitch_deg": (-95, 0)}, "pitch_deg: must lie within -90 and 90"),
        ({"test_paths": 3}, "test_paths: 0 test frames cannot be of 3 paths"),
        ({"mode": "repeat"}, "poses: mode `repeat` needs the poses"),
        ({"packed_px": 4000}, "packed_px: must be less than both sides"),
        ({"effects": {"motion_blur": {"exposure_s": 9}}}, "effects: motion_blur.exposure_s: 9 s"),
        ({"effects": {"noise": {"read": 5}}}, "effects: noise.read: unknown key"),
        ({"stereo_m": 0.1, "effects": {}}, "stereo_m: effects are of one camera"),
        ({"margin_m": 1}, "margin_m: goes with a sequence"),
        ({"colour": "red"}, "colour: no such option; there are mesh, "),
    ],
)
def test_an_error_names_the_setting_in_python_and_the_flag_on_the_command_line(
    options, named, room, capsys
):
    with pytest.raises(InputError) as caught:
        synfeal.plan(room, 5, **options)
    assert str(caught.value).startswith(named)
    name, value = next(iter(options.items()))
    if isinstance(value, int | float) and not isinstance(value, bool) and len(options) == 1:
        out = str(room.parent / "out")
        typed = ["collect", str(room), "--frames", "5", "--out", out, f"{flag_of(name)}={value}"]
        assert main(typed) == 1
        assert capsys.readouterr().err.startswith(f"error: {flag_of(name)}: ")


def test_a_mesh_that_is_not_there_is_named_by_its_place(tmp_path, capsys):
    typed = ["collect", str(tmp_path / "none.glb"), "--frames", "5", "--out", str(tmp_path / "x")]
    assert main(typed) == 1
    assert capsys.readouterr().err.startswith("error: MESH: ")


@pytest.mark.parametrize(
    ("before", "warning"),
    [
        (["collect", "--mesh", "ROOM", "--frames", "5", "--workers", "0"], "--cores"),
        (["collect", "ROOM", "--frames", "5", "--like-frames", "0", "5"], "--like-range"),
    ],
)
def test_flags_of_the_version_before_are_taken_with_a_warning(before, warning, room, caplog):
    typed = [str(room) if word == "ROOM" else word for word in before]
    assert main([*typed, "--out", str(room.parent / "out")]) == 1  # of what they are given
    assert any(warning in record.getMessage() for record in caplog.records)


def test_a_flag_may_be_written_with_its_unit(room, caplog):
    poses = room.parent / "poses.csv"
    typed = ["plan", str(room), "--frames", "5", "--spacing-m", "0.2", "--unit-m=1"]
    assert main([*typed, "--out", str(poses)]) == 0
    assert not [record for record in caplog.records if "called" in record.getMessage()]


@pytest.mark.parametrize("name", ["plan", "collect"])
def test_commands_of_the_version_before_are_taken_with_a_warning(name, room, caplog, capsys):
    typed = {
        "plan": ["plan", "--cores", "0"],
        "collect": ["collect", str(room), "--frames", "5", "--out", "mine", "--print-config"],
    }[name]
    assert main(typed) == (1 if name == "plan" else 0)
    now = {"plan": "cost", "collect": "profile"}[name]
    assert any(f"{name} is called {now}" in each.getMessage() for each in caplog.records)
    assert ("profile: mine" in capsys.readouterr().out) == (name == "collect")


def test_keywords_of_the_version_before_are_taken_with_a_warning(room):
    with pytest.warns(DeprecationWarning, match="spacing= is called spacing_m= now"):
        before = synfeal.plan(room, 5, spacing=0.2)
    now = synfeal.plan(room, 5, spacing_m=0.2)
    assert (before.position_m == now.position_m).all()


def test_an_unknown_name_is_no_function():
    with pytest.raises(AttributeError, match="no attribute 'paint'"):
        synfeal.paint  # noqa: B018
