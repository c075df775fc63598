"""Addresses for wire mocks that are free while other mocks run on the same machine."""

from __future__ import annotations

import random
import sys
from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

LOOPBACK = "127.0.0.1"


def free_ports(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options, of a mock's options model, that make it listen on free ports.

    A mock with fixed ports gets a separate loopback address instead.
    """
    ports = [name for name in fields if (name == "port" or name.endswith("_port")) and allows(fields[name], 0)]
    if ports:
        return dict.fromkeys(ports, 0)
    return {name: random_host() for name, field in fields.items() if has_own_host(name, field)}


def has_own_host(name: str, field: Any) -> bool:
    """Return whether an option is a host for which any loopback address can be chosen."""
    return name == "host" and field.default == LOOPBACK and sys.platform == "linux"


def random_host() -> str:
    """Return a loopback address that, most probably, no other program uses."""
    return "127." + ".".join(str(random.SystemRandom().randrange(2, 250)) for _ in range(3))


def allows(field: Any, value: Any) -> bool:
    """Return whether a field of an options model takes a value."""
    try:
        TypeAdapter(field.annotation).validate_python(value)
        for constraint in field.metadata:
            if getattr(constraint, "ge", value) > value:
                return False
    except ValidationError:
        return False
    return True
