"""Every installed backend's options, and those of `[tactile]`, reject values that only look like numbers."""

from __future__ import annotations

import typing

import pytest
from pydantic import ValidationError

from lsds.registry import PluginHost
from lsds.tactile.options import TactileOptions

HOST = PluginHost()
MODELS = {
    f"{backend.spec.kind}-{backend.spec.name}": HOST.options_model(backend)
    for backend in HOST.backends
    if backend.spec.options is not None
} | {"tactile": TactileOptions}


def fields(wanted):
    """All (model, field) whose annotation `wanted` accepts, `X | None` counting as X."""
    for model in MODELS.values():
        for name, field in model.model_fields.items():
            kinds = set(typing.get_args(field.annotation)) - {type(None)} or {field.annotation}
            if any(wanted(kind) for kind in kinds):
                yield model, name


NUMBERS = list(fields(lambda kind: kind in (float, int)))
FLOATS = list(fields(lambda kind: kind is float))
PAIRS = list(fields(lambda kind: typing.get_origin(kind) is tuple))


def complaints(model, name, value):
    """Return the errors of one field's value; missing other fields do not count."""
    try:
        model(**{name: value})
    except ValidationError as error:
        return [detail["type"] for detail in error.errors() if detail["loc"][:1] == (name,)]
    return []


def test_there_are_options_to_check():
    assert len(NUMBERS) > 45
    assert len(PAIRS) >= 2


@pytest.mark.parametrize("wrong", [True, "3"])
def test_true_and_text_are_no_numbers(wrong):
    taken = [f"{model.__name__}.{name}" for model, name in NUMBERS if not complaints(model, name, wrong)]
    assert taken == []


def test_a_whole_number_is_a_number():
    refused = [f"{model.__name__}.{name}" for model, name in FLOATS if "float_type" in complaints(model, name, 1)]
    assert refused == []


def test_a_pair_is_a_list_of_two_positive_whole_numbers():
    wrongs = ([True, 10], ["8", 10], [8.0, 10], [0, 10], [8, -1], [8], [8, 10, 12], 8, "8x10")
    assert [f"{model.__name__}.{name}" for model, name in PAIRS if complaints(model, name, [8, 10])] == []
    taken = [(model.__name__, name, w) for model, name in PAIRS for w in wrongs if not complaints(model, name, w)]
    assert taken == []
