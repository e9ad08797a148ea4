"""Static law from a table of forces."""

import dataclasses
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from pam_envs.data.channel_sources import ChannelSource
from pam_envs.data.force_table import ForceTable, is_force_table, load_force_table
from pam_envs.data.recording.recording import RecordingError
from pam_envs.data.rig_file import Rig
from pam_envs.identification.force_table import FITTED, fit_law
from pam_envs.plants.single_muscle.families import DMSP, base_plant

MAP = Path(str(resources.files("pam_envs.data"))) / "dmsp10_force_map.csv"
CHANNELS = {
    "pressure_bar": ChannelSource("pressure_pa", "Pa"),
    "contraction_mm": ChannelSource("length_m", "m", -1.0, 0.25),
    "force_N": ChannelSource("force_n"),
}


def table_of(muscle):
    grid = np.meshgrid((1e5, 2e5, 4e5, 6e5), np.linspace(0.0, 0.2, 9), indexing="ij")
    p, e = (v.ravel() for v in grid)
    force = np.maximum(0.0, muscle.tension(p, e))
    return ForceTable(p, e * muscle.rest_length, force, "simulated")


@pytest.mark.parametrize("diameter", [0.003, 0.01, 0.06])
def test_law_of_a_simulated_muscle_is_found(diameter):
    start = base_plant("festo_dmsp", 0.2, diameter).muscle
    true = dataclasses.replace(
        start,
        area=1.3 * start.area,
        area_taper=1.4,
        braid_force=0.6 * start.braid_force,
        braid_strain=0.02,
        stiffness=3.0 * start.stiffness,
    )
    table = table_of(true)
    fit = fit_law(table, start)
    assert fit.rms < 1e-3 * table.force.max()
    assert fit.values["area"] == pytest.approx(true.area, rel=0.02)
    assert fit.at_bound == ()


def test_measured_map_is_met_within_seven_and_a_half_newton():
    rig = Rig(channels=CHANNELS)
    assert is_force_table(MAP, rig)
    table = load_force_table(MAP, rig)
    assert len(table.force) == 85
    fit = fit_law(table, base_plant("festo_mas", 0.25, 0.01).muscle)
    assert fit.rms == pytest.approx(7.5, abs=0.1)
    for name in FITTED:
        assert fit.values[name] == pytest.approx(DMSP[f"muscle.{name}"], rel=0.01)


def test_parameter_at_its_bound_is_named():
    start = base_plant("festo_dmsp", 0.2, 0.01).muscle
    softening = dataclasses.replace(start, stiffness=0.0, softening=-2000.0)
    fit = fit_law(table_of(softening), start)
    assert "stiffness" in fit.at_bound
    assert fit.values["stiffness"] == 0.0


def file_of(folder: Path, rows: list[str]) -> Path:
    path = folder / "forces.csv"
    path.write_text("\n".join(["pressure_bar,contraction_mm,force_N", *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["1,0,10"] * 9, "column pressure_bar has 1 different values with a force above 0 N"),
        (["1,0,10"] * 3, "3 rows are too few; give at least 8"),
        ([f"{k},{k},{-k}" for k in range(9)], "force_N is below 0 N in rows 3, 4, 5, 6, 7 and 3"),
        (["1,0,"] * 9, "column force_N is empty in rows 2, 3, 4, 5, 6 and 4 more; fill"),
        (["1,0,x"] * 9, "column force_N holds no number in rows 2"),
    ],
)
def test_unusable_tables_are_refused(tmp_path, rows, said):
    path = file_of(tmp_path, rows)
    assert is_force_table(path, Rig())
    with pytest.raises(RecordingError) as caught:
        load_force_table(path, Rig())
    assert said in str(caught.value)
