from __future__ import annotations

import datetime
import tomllib

from fake_cell import FAKE_RIG, fake_host
from hypothesis import given
from hypothesis import strategies as st

from lsds.config import RigConfig, check_config, dump_config, load_config
from lsds.config.toml import dumps
from lsds.errors import ConfigError

HOST = fake_host()

text = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
scalars = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    text,
    st.dates(),
    st.datetimes(timezones=st.none() | st.just(datetime.UTC)),
)
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(text, inner, max_size=3),
    max_leaves=12,
)


@given(st.dictionaries(text, values, max_size=5))
def test_what_is_written_is_what_is_read(data):
    assert tomllib.loads(dumps(data)) == data


def test_not_a_number_is_written_as_such():
    assert str(tomllib.loads(dumps({"a": float("nan")}))["a"]) == "nan"


def sections(kind):
    table = st.fixed_dictionaries({}, optional={"latency_ms": st.floats(0, 1000), "fail": text})
    names = {
        "sensor": ["fake-sensor"],
        "gripper": ["fake-gripper", "real-gripper", "none"],
        "arm": ["fake-arm", "none"],
    }
    tables = {name: table for name in names[kind] if name != "none"}
    return st.fixed_dictionaries({"backend": st.sampled_from(names[kind])}, optional=tables)


configs = st.fixed_dictionaries(
    {
        **{kind: st.just(section) for kind, section in FAKE_RIG.items()},
        **{k: sections(k) for k in ("sensor", "gripper")},
    },
    optional={
        "seed": st.integers(0, 2**63 - 1),
        "clock": st.sampled_from(["auto", "virtual", "wall"]),
        "tactile": st.fixed_dictionaries({}, optional={"mm_per_px": st.floats(0.001, 1)}),
        "task": st.fixed_dictionaries({}, optional={"lift_s": st.floats(0, 600), "hold_s": st.integers(0, 600)}),
        "safety": st.fixed_dictionaries({}, optional={"max_aperture_m": st.floats(0.001, 0.5)}),
        "plugins": st.fixed_dictionaries({"block": st.lists(st.sampled_from(["x", "y-z"]))}),
    },
)


@given(configs)
def test_a_config_survives_the_way_to_toml_and_back(data):
    config = check_config(data, "random", HOST)
    again = check_config(tomllib.loads(dump_config(config)), "again", HOST)
    assert again == config
    assert dump_config(again) == dump_config(config)


junk = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | text,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(text, inner, max_size=3),
    max_leaves=8,
)


def complaints(call):
    """Return the issues that a call raises, empty if it raises none; any error but a ConfigError is a defect."""
    try:
        call()
    except ConfigError as error:
        return error.issues or [None]
    return ()


@given(st.dictionaries(st.sampled_from(sorted(RigConfig.model_fields)) | text, junk, max_size=4))
def test_any_rubbish_gives_a_config_or_clear_issues(data):
    assert all(issue.path and issue.problem for issue in complaints(lambda: check_config(data, "rubbish", HOST)))


@given(st.lists(st.text(max_size=20), max_size=3))
def test_any_override_gives_a_config_or_clear_issues(overrides):
    assert all(issue.path and issue.problem for issue in complaints(lambda: load_config(None, overrides, host=HOST)))
