"""Recording with a hidden effect that ships with the package: CSV, rig file, sealed truth."""

import gzip
import io
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.diagnosis.cases import CAMPAIGNS
from benchmarks.diagnosis.sources import columns_of, draw_effect, draw_rig, outputs_of, sheet_of
from pam_envs.constants import BAR, MM
from pam_envs.data import example
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.causes import by_name
from pam_envs.files import write_bytes
from tests.diagnosis.hidden import EFFECTS

WORLD, AMPLITUDE = "exponential_pressure_play_lag", 12.0
SEED = 81_000_040
"""Draws rig, effect and noise; no set of the benchmark has it."""
FORMATS = {
    "time_s": ".2f",
    "pressure_command_bar": ".4g",
    "pressure_bar": ".3f",
    "contraction_mm": ".3f",
    "load_N": "g",
    "temperature_C": "g",
}
"""Formats of the columns, finer than the noise of the sensors."""


def write(folder: Path = example.FOLDER) -> list[Path]:
    """Simulate the rig, write the three files of the example and return their paths."""
    rng = np.random.default_rng(SEED)
    campaign = CAMPAIGNS["short"](SEED)
    name, rig = str(rng.choice(EFFECTS)), draw_rig(WORLD, rng)
    effects = [(draw_effect(name, rig, rng), AMPLITUDE)]
    columns = columns_of(rig, effects, campaign, SEED)
    change = outputs_of(rig, effects, campaign) - outputs_of(rig, [], campaign)
    rms_mm, rms_bar = np.sqrt((change**2).mean(axis=1)) / [MM, BAR]
    truth = {
        "names": [name],
        "text": (
            f"{by_name(name).title}, which changes the contraction by {rms_mm:.2f} mm and the "
            f"pressure by {rms_bar:.3f} bar (RMS)"
        ),
        "world": WORLD,
        "rms_mm": round(float(rms_mm), 4),
        "rms_bar": round(float(rms_bar), 5),
    }
    recording = gzip.compress(csv_text(columns).encode(), mtime=0)
    files = {
        example.RECORDING: recording,
        example.RIG: yaml.safe_dump(
            rig_content(sheet_of(rig, campaign)), sort_keys=False, default_flow_style=None
        ).encode(),
        example.TRUTH: example.sealed(truth, recording).encode(),
    }
    for name, data in files.items():
        write_bytes(folder / name, data)
    return [folder / name for name in files]


def csv_text(columns: dict[str, Any]) -> str:
    """Return the columns of a recording as CSV."""
    text = io.StringIO()
    text.write(",".join(columns) + "\n")
    for row in zip(*(values.tolist() for values in columns.values()), strict=True):
        cells = zip(columns, row, strict=True)
        text.write(",".join(format(value, FORMATS.get(name, "")) for name, value in cells) + "\n")
    return text.getvalue()


def rig_content(sheet: Rig) -> dict[str, Any]:
    """Return the content of the rig file of declared facts."""
    assert sheet.rest_length and sheet.diameter and sheet.max_pressure
    assert sheet.contraction_noise and sheet.pressure_noise
    return {
        "plant": sheet.plant,
        "muscle": {
            "rest_length_mm": round(sheet.rest_length / MM, 2),
            "diameter_mm": round(sheet.diameter / MM, 2),
        },
        "regulator": {"max_pressure_bar": round(sheet.max_pressure / BAR, 3)},
        "load": sheet.load,
        "sensors": {
            "contraction_noise_mm": round(sheet.contraction_noise / MM, 4),
            "pressure_noise_bar": round(sheet.pressure_noise / BAR, 5),
        },
        "history": {"cycles_since_rest": 0, "rezeroed": False, "settled": sheet.settled},
        "repeats": [list(group) for group in sheet.repeats],
        "valve_closed": list(sheet.valve_closed),
        "tolerance": dict(sheet.tolerance),
    }
