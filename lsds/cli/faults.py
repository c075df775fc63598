"""`--fault NAME[:SEVERITY][@MOMENT]`: a table of `[[faults]]`, from the command line."""

from __future__ import annotations

import re
from collections.abc import Sequence

from lsds.config.overrides import override_texts
from lsds.errors import ConfigError, ConfigIssue

_FORM = re.compile(r"(?P<name>[^:@]+)(:(?P<severity>0|[1-9]\d*))?(@(?P<moment>.+))?")


def faults_override(faults: Sequence[str]) -> list[str]:
    """Return the override that sets the faults, none for none. Raises ConfigError for a text of another form."""
    tables = []
    for text in faults:
        found = _FORM.fullmatch(text)
        if found is None:
            issue = ConfigIssue(
                f"--fault {text}", "is not NAME[:SEVERITY][@MOMENT]", "write --fault camera-noise:5@lift"
            )
            raise ConfigError("the command line", [issue])
        name, severity, moment = found["name"], found["severity"], found["moment"]
        tables.append({"backend": name, "severity": None if severity is None else int(severity), "at": moment})
    return override_texts({"faults": tables}) if tables else []
