"""Every installed backend's options refuse what only looks like a number."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from lsds.plugins import PluginHost

HOST = PluginHost()
MODELS = [
    (backend.spec.kind, backend.spec.name, HOST.options_model(backend))
    for backend in HOST.backends
    if backend.spec.options is not None
]
FIELDS = [
    pytest.param(model, name, id=f"{kind}-{backend}-{name}")
    for kind, backend, model in MODELS
    for name, field in model.model_fields.items()
    if field.annotation in (float, int)
]


def test_there_are_options_to_check():
    assert len(FIELDS) > 40


@pytest.mark.parametrize(("model", "name"), FIELDS)
def test_true_and_text_are_no_numbers(model, name):
    for wrong in (True, "3"):
        with pytest.raises(ValidationError, match=name):
            model(**{name: wrong})
