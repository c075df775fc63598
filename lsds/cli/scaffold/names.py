"""The names in a scaffold: backend, distribution, package, class prefix."""

from __future__ import annotations

import keyword
import re
import sys
from dataclasses import dataclass

from lsds.errors import ConfigError, ConfigIssue

LONGEST_NAME = 30
"""Maximum number of characters of a name, so that no line of a scaffold is longer than 120."""
LONGEST_DISTRIBUTION = 40
"""Maximum number of characters of a distribution's name, for the same reason."""
_BACKEND = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
_OWN = ("lsds", "lsds_tactile", "lsds_plugins", "lsds_research", "lsds_drivers", "lsds_mocks")
_RESERVED = ("none", "lsds", "mock")


@dataclass(frozen=True, slots=True)
class Names:
    """The names of one scaffold. `prefix` begins the names of its classes."""

    kind: str
    name: str
    distribution: str
    package: str
    prefix: str


def names_of(kind: str, name: str, distribution: str = "") -> Names:
    """Return the names for a backend; the distribution is "lsds-NAME" by default. Raises ConfigError."""
    distribution = distribution or f"lsds-{name}"
    package = distribution.replace("-", "_")
    issues = []
    for what, value, most in (("NAME", name, LONGEST_NAME), ("--distribution", distribution, LONGEST_DISTRIBUTION)):
        if not _BACKEND.fullmatch(value) or len(value) > most:
            remedy = f"lower case letters, digits and single hyphens, at most {most} characters, such as acme-2f"
            issues.append(ConfigIssue(what, f"'{value}' is not a valid name", remedy))
            break
    if name in _RESERVED:
        issues.append(ConfigIssue("NAME", f"'{name}' is reserved", "choose another name"))
    elif package in _OWN or package in sys.stdlib_module_names or keyword.iskeyword(package):
        problem = f"'{package}' is the name of an existing package"
        issues.append(ConfigIssue("--distribution", problem, "choose another name"))
    if issues:
        raise ConfigError("lsds new", issues)
    return Names(kind, name, distribution, package, "".join(part.capitalize() for part in name.split("-")))
