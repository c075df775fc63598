"""Studies whose objects would have no effect on the chosen cell are refused; other idle keys are named."""

from __future__ import annotations

import pytest
from lsds_research.idle_keys import idle_keys, require_objects
from lsds_research.search.robustness import Limits
from lsds_research.search.scenarios import require_usable
from lsds_research.search.space import DEFAULT, Axis

import lsds
from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import ConfigError

MUJOCO = "cell.backend=mujoco"


def test_keys_of_backends_that_are_not_used_are_idle():
    config = lsds.load_config(None, ["controller.backend=pd"])
    keys = ["controller.belief.margin", "controller.pd.kp", "task.lift_s", "controller.enabled", "seed"]
    assert idle_keys(config, keys) == {"controller.belief.margin": "pd"}
    assert idle_keys(lsds.load_config(None, ["controller.backend=lsds:pd"]), keys[1:2]) == {}


def test_objects_of_another_cell_are_refused():
    keys = ["cell.simulated.object", "seed"]
    require_objects(lsds.load_config(), keys)
    with pytest.raises(ConfigError, match=r"cell.simulated.object has no effect on the cell 'mujoco'.*backend"):
        require_objects(lsds.load_config(None, [MUJOCO]), keys)


def test_a_space_of_objects_of_another_cell_is_refused():
    with pytest.raises(ConfigError, match="has no effect on the cell 'mujoco'"):
        require_usable(DEFAULT, dict, Limits(), [MUJOCO], "")
    idle = require_usable([Axis("controller.pd.kp", 0.1, 1.0), Axis("seed", 0, 9, whole=True)], dict, Limits(), [], "")
    assert idle == {"controller.pd.kp": "belief"}


def test_the_study_of_grip_refuses_another_cell():
    from lsds_research.studies.grip.options import GripOptions
    from lsds_research.studies.grip.study import GripStudy

    study = GripStudy(GripOptions(settings=[MUJOCO]), BuildContext(VirtualClock()))
    with pytest.raises(ConfigError, match="has no effect on the cell 'mujoco'"):
        study.run(lambda done, asked: None)
