from __future__ import annotations

import json
import tomllib

import pytest
from fake_cell import FAKE_RIG, plugin
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from pydantic import BaseModel, ConfigDict

from lsds.config import RigConfig, check_config, dump_config, json_schema, load_config
from lsds.config.example import example_config
from lsds.config.overrides import parse_override
from lsds.config.reading import line_of, value_at
from lsds.contracts import BackendSpec
from lsds.errors import ConfigError, ConfigIssue
from lsds.registry import PluginHost

FAKES = "\n".join(f'[{kind}]\nbackend = "{section["backend"]}"' for kind, section in FAKE_RIG.items())


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")

    path: str


def write(tmp_path, text):
    path = tmp_path / "rig.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def issues(call, *arguments, **keywords):
    with pytest.raises(ConfigError) as caught:
        call(*arguments, **keywords)
    return {issue.path: issue for issue in caught.value.issues}


def test_the_default_is_the_simulated_cell():
    config = RigConfig()
    assert config.sensor.backend == "mock-gelsight-mini"
    assert config.gripper.backend == "mock-hand-e"
    assert config.arm.backend == "mock-ur5e"
    assert config.cell.backend == "simulated"
    assert config.clock == "auto"
    assert config.controller.enabled
    with pytest.raises(ValueError, match="frozen"):
        config.seed = 3


def test_a_file_and_overrides(tmp_path, host):
    path = write(tmp_path, FAKES + "\n[gripper.fake-gripper]\nlatency_ms = 40\n[task]\nlift_s = 2.5\n")
    overrides = ["task.lift_s=1", "gripper.fake-gripper.fail=arm", "clock=wall", 'arm.backend="none"', "seed = 9"]
    config = load_config(path, overrides, host=host)
    assert config.task.lift_s == 1
    assert config.gripper.options() == {"latency_ms": 40, "fail": "arm"}
    assert config.clock == "wall"
    assert not config.arm.chosen
    assert config.seed == 9


def test_a_section_may_hold_options_alone(host):
    data = {**FAKE_RIG, "gripper": {"mock-hand-e": {"x": 1}}}
    assert RigConfig.model_validate(data).gripper.backend == "mock-hand-e"


def test_swapping_a_backend_is_one_line(tmp_path, host):
    text = FAKES + "\n[gripper.fake-gripper]\nlatency_ms = 40\n[gripper.real-gripper]\nlatency_ms = 2\n"
    one = load_config(write(tmp_path, text), host=host)
    other = load_config(write(tmp_path, text.replace('"fake-gripper"', '"real-gripper"')), host=host)
    assert one.gripper.options() == {"latency_ms": 40}
    assert other.gripper.options() == {"latency_ms": 2}


def test_all_problems_at_once(tmp_path, host):
    text = FAKES.replace('"fake-arm"', '"fake-amr"') + (
        "\n[gripper.fake-gripper]\nlatncy_ms = 40\n[gripper.real-gripper]\nlatency_ms = 'slow'\n"
        "[gripper.hand-f]\nport = 1\n[tactil]\n[task]\nlift_s = -1\n[safety]\nwatchdog_s = 'soon'\n"
    )
    found = issues(load_config, write(tmp_path, "seed = 1.5\nclock = 'virtul'\n" + text), host=host)
    assert set(found) == {
        "seed",
        "clock",
        "arm.backend",
        "gripper.fake-gripper.latncy_ms",
        "gripper.real-gripper.latency_ms",
        "gripper.hand-f",
        "tactil",
        "task.lift_s",
        "safety.watchdog_s",
    }
    assert "did you mean 'virtual'?" in found["clock"].remedy
    assert "did you mean 'fake-arm'?" in found["arm.backend"].remedy
    assert "did you mean 'latency_ms'?" in found["gripper.fake-gripper.latncy_ms"].remedy
    assert "did you mean 'tactile'?" in found["tactil"].remedy
    assert "'slow'" in found["gripper.real-gripper.latency_ms"].problem


def test_an_option_outside_its_table_is_an_error_that_names_the_table(fake_rig, host):
    fake_rig["gripper"]["port"] = "/dev/ttyUSB0"
    found = issues(check_config, fake_rig, "rig", host)
    assert list(found) == ["gripper.port"]
    assert "[gripper.fake-gripper]" in found["gripper.port"].remedy


def test_no_device_is_allowed_where_a_rig_can_do_without(fake_rig, host):
    for kind in ("gripper", "arm", "pose_source", "cell"):
        fake_rig[kind] = {"backend": "none"}
    assert not check_config(fake_rig, "rig", host).gripper.chosen
    fake_rig["sensor"] = {"backend": "none"}
    assert "a rig needs a sensor" in issues(check_config, fake_rig, "rig", host)["sensor.backend"].problem


def test_options_that_are_required_are_missed_without_a_table(fake_rig, host):
    host.register(
        plugin(BackendSpec("sensor", "strict", "fake_cell:FakeSensor", f"{__name__}:Strict")),
        distribution="d",
        name="strict",
    )
    fake_rig["sensor"] = {"backend": "strict"}
    assert list(issues(check_config, fake_rig, "rig", host)) == ["sensor.strict.path"]


def test_a_backend_that_is_not_chosen_may_be_broken(fake_rig, host):
    fake_rig["gripper"]["odd-options"] = {"x": 1}
    assert check_config(fake_rig, "rig", host)
    fake_rig["gripper"]["backend"] = "odd-options"
    assert "not a pydantic model" in issues(check_config, fake_rig, "rig", host)["gripper.odd-options"].problem


def test_a_conflict_is_an_issue_and_a_qualified_name_resolves_it(fake_rig, host):
    spec = BackendSpec("gripper", "fake-gripper", "fake_cell:FakeGripper", "fake_cell:Options")
    host.register(plugin(spec), distribution="other", name="other")
    assert "choose one" in issues(check_config, fake_rig, "rig", host)["gripper.backend"].problem
    fake_rig["gripper"] = {"backend": "other:fake-gripper", "fake-gripper": {"latency_ms": 5}}
    config = check_config(fake_rig, "rig", host)
    assert config.gripper.options() == {"latency_ms": 5}
    assert load_text(dump_config(config), host) == config


def test_blocked_plugins_are_not_there(fake_rig, host):
    fake_rig["plugins"] = {"block": ["fakes"]}
    found = issues(check_config, fake_rig, "rig", host)
    assert "sensor.backend" in found
    assert "blocked" in found["sensor.backend"].remedy


def load_text(text, host):
    return check_config(tomllib.loads(text), "text", host)


@pytest.mark.parametrize(
    ("override", "path"),
    [
        ("seed=true", "seed"),
        ('seed="3"', "seed"),
        ("controller.enabled=1", "controller.enabled"),
        ("safety.watchdog_s=true", "safety.watchdog_s"),
        ("schedule.arm_rate_hz=fast", "schedule.arm_rate_hz"),
        ("schedule.arm_rate_hz=nan", "schedule.arm_rate_hz"),
        ("gripper.backend=3", "gripper.backend"),
        ("gripper=3", "gripper"),
        ("plugins.block=3", "plugins.block"),
        ("plugins=3", "plugins"),
    ],
)
def test_a_wrong_type_is_one_issue(tmp_path, host, override, path):
    assert list(issues(load_config, write(tmp_path, FAKES), [override], host=host)) == [path]


def test_nan_is_no_number(tmp_path, host):
    found = issues(load_config, write(tmp_path, FAKES), ["schedule.arm_rate_hz=nan"], host=host)
    assert found["schedule.arm_rate_hz"].problem == "is NaN, not a number"


def test_a_number_for_a_text_is_an_error_that_asks_for_quotes(tmp_path, host):
    found = issues(load_config, write(tmp_path, FAKES), ["gripper.fake-gripper.fail=3"], host=host)
    assert found["gripper.fake-gripper.fail"].remedy == "put it in quotes: '\"3\"'"


# -- files that cannot be read ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seed = 1\nclock = wall\n", ["line 2", "column 9", "quotes"]),
        ("[gripper\nbackend = 'x'\n", ["line 1", "column 9"]),
        ("seed = 1\nseed = 2\n", ["line 2", "overwrite"]),
        ('clock = "wall', ["Unterminated string", "end of document"]),
        (b"seed = 1\n# \xff\n", ["line 2", "0xff", "UTF-8"]),
    ],
)
def test_what_is_not_toml_is_shown_by_place(tmp_path, host, text, words):
    with pytest.raises(ConfigError) as caught:
        load_config(write(tmp_path, text), host=host)
    assert len(caught.value.issues) == 1
    for word in words:
        assert word in str(caught.value)


def test_a_byte_order_mark_does_not_matter(tmp_path, host):
    assert load_config(write(tmp_path, b"\xef\xbb\xbf" + FAKES.encode()), host=host)


def test_missing_file_and_directory(tmp_path, host):
    with pytest.raises(ConfigError, match=r"does not exist.*lsds config example"):
        load_config(tmp_path / "nope.toml", host=host)
    with pytest.raises(ConfigError, match="is a directory"):
        load_config(tmp_path, host=host)


# -- --set ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "path", "value"),
    [
        ("seed=3", ("seed",), 3),
        ("gripper.hand-e.port=/dev/ttyUSB0", ("gripper", "hand-e", "port"), "/dev/ttyUSB0"),
        ("a.b=true", ("a", "b"), True),
        ("a.b=True", ("a", "b"), "True"),
        ("a.b=[1, 2]", ("a", "b"), [1, 2]),
        ('a."b c".d = "x=y"', ("a", "b c", "d"), "x=y"),
        ("a=x=y", ("a",), "x=y"),
        ("a=hand-e", ("a",), "hand-e"),
        ("a=1\nb=2", ("a",), "1\nb=2"),
        ('a=""', ("a",), ""),
    ],
)
def test_override(text, path, value):
    assert parse_override(text) == (path, value)


@pytest.mark.parametrize("text", ["seed", "=3", "a..b=1", "a b=1", "a=", "a=[1,", 'a="x', "a.=1", "[a]=1", "a#=1"])
def test_wrong_overrides_are_issues(text, host):
    assert isinstance(parse_override(text), ConfigIssue)


def test_overrides_report_with_everything_else(host):
    found = issues(load_config, None, ["seed", "seed.x.y=1", "task.lift_s=-1"], host=host)
    assert "--set seed" in found
    assert "task.lift_s" in found


def test_an_override_through_a_value_is_an_issue(tmp_path, host):
    found = issues(load_config, write(tmp_path, "seed = 1\n" + FAKES), ["seed.x=1"], host=host)
    assert "'seed' is not a table" in found["--set seed.x=1"].problem


# -- writing and the schema -------------------------------------------------------------------------------


def test_the_example_is_the_default_with_comments():
    text = example_config(host=PluginHost(entry_points=[]))
    assert RigConfig.model_validate(tomllib.loads(text)) == RigConfig()
    assert "lift_s = 3.0  # duration of the lift" in text
    assert "# mm_per_px =  # scale of the image" in text


def test_the_example_shows_the_options_of_what_is_chosen(host, fake_rig):
    text = example_config(check_config(fake_rig, "fakes", host), host)
    assert "[gripper.fake-gripper]\nlatency_ms = 0.0  # age of what is read" in text
    assert "# The gripper; installed: fake-gripper, gone" in text
    assert load_text(text, host).gripper.options() == {"latency_ms": 0.0, "fail": ""}


def test_the_schema_is_sound_and_accepts_what_the_loader_accepts(host):
    schema = json_schema(host)
    assert schema["$schema"].endswith("2020-12/schema")
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    good = {**FAKE_RIG, "gripper": {"backend": "fake-gripper", "fake-gripper": {"latency_ms": 3}}}
    assert check_config(good, "good", host)
    validator.validate(good)
    validator.validate({"gripper": {"backend": "none"}})
    validator.validate({"gripper": {"backend": "fakes:fake-gripper"}})
    json.dumps(schema)


@pytest.mark.parametrize(
    "bad",
    [
        {"gripper": {"backend": "hand-f"}},
        {"gripper": {"backend": "fake-gripper", "fake-gripper": {"latncy_ms": 3}}},
        {"gripper": {"backend": "fake-gripper", "fake-gripper": {"latency_ms": -3}}},
        {"gripper": {"backend": "fake-gripper", "port": "x"}},
        {"sensor": {"backend": "none"}},
        {"detector": {"backend": "plain", "plain": {"x": 1}}},
        {"tactil": {}},
        {"seed": "x"},
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(host, bad):
    assert not Draft202012Validator(json_schema(host)).is_valid(bad)
    with pytest.raises(ConfigError):
        check_config({**FAKE_RIG, **bad}, "bad", host)


def test_the_schema_keeps_going_past_a_broken_backend(host):
    table = json_schema(host)["properties"]["gripper"]["properties"]["odd-options"]
    assert "not a pydantic model" in table["description"]


# -- what is installed ------------------------------------------------------------------------------------


def test_the_default_loads_and_is_valid_with_the_installed_plugins(installed_host):
    config = load_config(host=installed_host)
    validator = Draft202012Validator(json_schema(installed_host))
    validator.validate(json.loads(config.model_dump_json()))
    example = example_config(host=installed_host)
    validator.validate(tomllib.loads(example))
    assert load_text(example, installed_host).sensor.backend == "mock-gelsight-mini"


def test_every_config_of_the_repository_loads(installed_host, root):
    validator = Draft202012Validator(json_schema(installed_host))
    files = sorted([*root.glob("examples/**/*.toml"), *root.glob("docs/**/*.toml")])
    # Examples of other distributions need what they install, and have their own tests.
    for path in (path for path in files if "plugins" not in path.relative_to(root).parts):
        load_config(path, host=installed_host)
        validator.validate(tomllib.loads(path.read_text(encoding="utf-8")))


def test_a_config_may_name_its_schema_for_editors(tmp_path):
    file = tmp_path / "rig.toml"
    file.write_text('#:schema rig.schema.json\n"$schema" = "rig.schema.json"\nseed = 3\n')
    assert load_config(file).seed == 3


def test_the_schema_allows_its_own_name():
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate({"$schema": "rig.schema.json", "seed": 3}, json_schema())


def test_a_missing_option_is_described():
    with pytest.raises(ConfigError, match=r"robotiq-2f\.port: is missing \(serial port .*lsds devices lists ports"):
        load_config(None, ["gripper.backend=robotiq-2f"])


def test_one_override_may_be_a_text():
    assert load_config(None, "seed=7").seed == 7
    with pytest.raises(ConfigError, match="sed"):
        load_config(None, "sed=7")


_VALUES = st.sampled_from(["1", "'x'", '"""\n[a]\nb = 2\n"""', "[\n 1,\n\n 2]", "{c = 3}", "'y'  # a = 1"])


@given(st.lists(st.tuples(st.sampled_from("abcd"), _VALUES), max_size=12), st.lists(st.integers(0, 12), max_size=3))
def test_the_line_of_a_key_is_the_first_after_the_last_beginning_without_it(pairs, tables):
    lines, used, table = [], set(), ""
    for number, (key, value) in enumerate(pairs):
        if number in tables:
            table = f"t{number}."
            lines += ["", f"[t{number}]  # a table"]
        if table + key not in used:
            used.add(table + key)
            lines.append(f"{key} = {value}")
    text = "\n".join(lines) + "\n"
    whole = text.split("\n")
    for path in used:
        last = 0
        for count in range(len(whole) + 1):
            try:
                beginning = tomllib.loads("\n".join(whole[:count]) + "\n")
            except tomllib.TOMLDecodeError:
                continue
            if value_at(beginning, path) is not None:
                break
            last = count
        assert line_of(text, path) == last + 1
    assert line_of(text, "z") is None


def test_a_wrong_value_is_named_with_the_line_of_its_key(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text(
        'calibration = [\n  7,\n]\n\n[sensor.mock-gelsight-mini]\nrate_hz = """\n[grip]\npower = 3"""\n'
        '[grip]  # not the one above\n"power" = 7\nnoise = 0.2\n',
        encoding="utf-8",
    )
    with pytest.raises(ConfigError) as caught:
        load_config(rig, "grip.noise=9")
    assert {issue.path: issue.line for issue in caught.value.issues} == {
        "calibration.0": 1,
        "grip.power": 10,
        "grip.noise": None,
        "sensor.mock-gelsight-mini.rate_hz": 6,
    }
    assert "grip.power (line 10): should be" in str(caught.value)
