"""A muscle with the inputs of a short recording."""

from pathlib import Path

import pytest

from pam_envs.diagnosis.fit.single_muscle import MuscleFamily, inputs_of, start_plant
from tests.diagnosis.conftest import recorded
from tests.diagnosis.hidden import Campaign


@pytest.fixture(scope="module")
def family(short: Campaign, tmp_path_factory: pytest.TempPathFactory) -> MuscleFamily:
    folder: Path = tmp_path_factory.mktemp("recording")
    recording, rig = recorded(folder, "creep", 0.0, short)
    return MuscleFamily(start_plant(rig), inputs_of(recording, rig), 0.04)
