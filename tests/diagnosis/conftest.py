"""Hidden rigs, and their recordings as files."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from pam_envs.data.recording.recording import Recording, load_recording
from pam_envs.data.rig_file import Rig
from pam_envs.kernels.build import COMPILED
from tests.diagnosis import hidden
from tests.diagnosis.hidden import Campaign, Effect

needs_kernels = pytest.mark.skipif(not COMPILED, reason="too many samples for plain Python")
NOISE = {
    "contraction_mm": hidden.CONTRACTION_NOISE_MM,
    "pressure_bar": hidden.PRESSURE_NOISE_BAR,
}


@pytest.fixture(scope="session")
def short() -> Campaign:
    return hidden.campaign_short()


def base_of(seed: int = 3) -> hidden.Base:
    return hidden.draw_base(np.random.default_rng(seed))


def effect_of(name: str, seed: int = 1, **shape: float) -> Effect:
    effect = hidden.draw_effect(name, np.random.default_rng(seed))
    return dataclasses.replace(effect, shape={**effect.shape, **shape})


def size(one: dict, other: dict) -> float:
    """Return the RMS of the difference over that of the noise, on the louder channel."""
    return max(float(np.sqrt(np.mean((one[n] - other[n]) ** 2))) / NOISE[n] for n in NOISE)


def recorded(
    folder: Path, name: str, amplitude: float, campaign: Campaign
) -> tuple[Recording, Rig]:
    """Return a recording and its rig file, written as ``recording.csv`` and ``rig.yaml``."""
    random = np.random.default_rng(8)
    base = hidden.draw_base(random)
    effects = [(hidden.draw_effect(name, random), amplitude)] if amplitude else []
    columns = hidden.make_recording(base, effects, campaign, noise_seed=4)
    hidden.write_csv(columns, folder / "recording.csv")
    (folder / "rig.yaml").write_text(yaml.safe_dump(hidden.rig_yaml(base, campaign)))
    rig = Rig.from_yaml(folder / "rig.yaml")
    return load_recording(folder / "recording.csv", rig), rig
