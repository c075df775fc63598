"""`--fault NAME[:SEVERITY][@MOMENT]`: a table of `[[faults]]`, from the command line."""

from __future__ import annotations

import re
from collections.abc import Sequence

from lsds.config.toml import value_text
from lsds.errors import ConfigError, ConfigIssue

_FORM = re.compile(r"(?P<name>[^:@]+)(:(?P<severity>\d+))?(@(?P<moment>.+))?")


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
        keys = {"backend": value_text(name)}
        keys |= {} if severity is None else {"severity": severity}
        keys |= {} if moment is None else {"at": value_text(moment)}
        tables.append("{" + ", ".join(f"{key} = {value}" for key, value in keys.items()) + "}")
    return [f"faults=[{', '.join(tables)}]"] if tables else []
