"""Predicted against measured closed-loop figures: a simulated plant plays the rig."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baselines.core.catalogue import make_controller
from pam_envs.__main__ import main
from pam_envs.envs.positioning.env import MusclePositioningEnv
from pam_envs.plants import SingleMuscle
from pam_envs.rig.comparison import references, table
from pam_envs.rig.comparison.comparison import compare
from pam_envs.rig.comparison.figures import FIGURES, Run, settled_parts
from pam_envs.rig.comparison.prediction import Prediction, Settings, predict, reach_of
from pam_envs.rig.comparison.references import Holds
from pam_envs.rig.comparison.table import Condition

PERIOD, LOAD, SECONDS = 0.01, 2.55, 4.0
NAMES = ("predictive_inverse_dob", "inverse", "pid", "zero")
"""Controllers from good to bad."""
PATH = 5.0 - 4.0 * np.cos(np.arange(0.0, SECONDS, PERIOD) * 2.0)  # mm


def measured_on(rig: SingleMuscle, model: SingleMuscle, name: str) -> float:
    """Return the RMS error [mm] of a controller on a rig, by the test's own loop."""
    reference, limits = 1e-3 * PATH, {"highest_contraction": 0.1}
    env: Any = MusclePositioningEnv(
        plant=rig,
        reference=reference,
        load=LOAD,
        start="rest",
        episode_seconds=SECONDS,
        reward=limits,
    )
    controller = make_controller(name, model, env.signals, env.action_signals)
    observation, _ = env.reset(seed=77)
    state, over, errors = None, False, []
    while not over:
        action, state = controller.predict(observation, state, not errors, True)
        observation, _, _, over, info = env.step(action)
        errors.append(1e3 * (info["sensor/contraction"] - info["reference"]))
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope="module")
def rig_data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the plant files, table and reference of a rig."""
    folder = tmp_path_factory.mktemp("rig")
    nominal = SingleMuscle.mas10()
    true = replace(nominal, ensemble=()).replace(
        {
            "muscle.stiffness": 1.05 * nominal.muscle.stiffness,
            "regulator.time_constant": 1.2 * nominal.regulator.time_constant,
        }
    )
    nominal.to_yaml(folder / "nominal.yaml")
    true.to_yaml(folder / "true.yaml")
    lines = ["# figures of a rig", "controller,load_kg,rms_mm"]
    lines += [f"{name},{LOAD},{measured_on(true, nominal, name):.6g}" for name in NAMES]
    (folder / "table.csv").write_text("\n".join(lines) + "\n")
    times = np.arange(len(PATH)) * PERIOD
    samples = [f"{t:.3f},{r:.9f}" for t, r in zip(times, PATH, strict=True)]
    (folder / "path.csv").write_text("\n".join(["time_s,reference_mm", *samples]) + "\n")
    return folder


def compared(folder: Path, plant: str, *more: str) -> dict[str, Any]:
    given = ["compare-rig", str(folder / "table.csv"), "--plant", str(folder / plant)]
    given += ["--reference", str(folder / "path.csv"), "--runs", "3", *more]
    out = folder / f"out_{plant}"
    assert main([*given, "--out", str(out)]) == 0
    assert (out / "comparison.png").read_bytes()[:4] == b"\x89PNG"
    return json.loads((out / "comparison.json").read_text())


def test_ranks_of_a_rig_are_recovered_by_another_plant(
    rig_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = compared(rig_data, "nominal.yaml")
    printed = capsys.readouterr().out
    measured = [row["measured"] for row in found["rows"]]
    assert measured == sorted(measured)
    (ranking,) = found["rankings"]
    assert ranking["kendall"]["value"] == ranking["spearman"]["value"] == 1.0
    assert found["text"] in printed
    assert all(name in printed for name in NAMES)
    assert found["rows"][0]["knowledge"] == "nominal model"
    # the plant is not the rig, and the figures show it
    assert not all(row["within_interval"] for row in found["rows"])


def test_figures_of_the_rigs_own_plant_are_predicted(rig_data: Path) -> None:
    found = compared(rig_data, "true.yaml", "--model", str(rig_data / "nominal.yaml"))
    for row in found["rows"]:
        assert row["predicted"] == pytest.approx(row["measured"], rel=0.05), row["controller"]
    assert found["model"] != found["plant"]


def test_few_controllers_are_said_to_be_no_evidence(rig_data: Path) -> None:
    settings = settings_of(runs=3)
    lines = (rig_data / "table.csv").read_text().splitlines()[:5]
    (rig_data / "few.csv").write_text("\n".join(lines))
    measured = table.read(rig_data / "few.csv", LOAD, rig_data / "path.csv")
    found = compare(settings, measured)
    assert len(found.rows) == 3
    assert "this does not show that the order is predicted" in found.text


def test_controller_that_is_not_in_the_catalogue_is_refused(
    tmp_path: Path, rig_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "wrong.csv").write_text("controller,rms_mm\ninverse,1.0\ninvers_pid,2.0\n")
    plant = str(rig_data / "nominal.yaml")
    assert main(["compare-rig", str(tmp_path / "wrong.csv"), "--plant", plant]) == 2
    said = capsys.readouterr().err
    assert "line 3: no controller of PAM/MusclePositioning-v0 is named 'invers_pid'" in said
    assert "inverse_pid" in said
    assert "PAM_ENVS_CONTROLLERS" in said


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("controller,rms_mm\n", "1 lines"),
        ("controller,rms\npid,1\n", "did you mean 'rms_mm'"),
        ("controller,load_kg\npid,1\n", "no figure; add a column of rms_mm"),
        ("name,rms_mm\npid,1\n", "column 'name' is not known"),
        ("load_kg,rms_mm\n1,1\n", "no column 'controller'"),
        ("controller,rms_mm,rms_mm\npid,1,1\n", "occurs twice"),
        ("controller,rms_mm\npid,\n", "line 2 has no figure"),
        ("controller,rms_mm\n,2.0\n", "line 2 has no controller"),
        ("controller,rms_mm\npid,-1\n", "rms_mm = '-1' must be a number from 0"),
        ("controller,rms_mm\n# gap\npid,much\n", "line 3: rms_mm = 'much' must be a number"),
        ("controller,load_kg,rms_mm\npid,9,1\n", "load_kg = '9' must be a number from 0 to 5"),
        ("controller,rms_mm\npid,1\npid,2\n", "on line 2 already; give the mean"),
        ("controller,rms_mm\npid,1,2\n", "3 cells and the header 2"),
    ],
)
def test_faults_of_a_table_name_line_value_and_remedy(
    tmp_path: Path, content: str, said: str
) -> None:
    (tmp_path / "table.csv").write_text(content)
    with pytest.raises(ValueError, match=said):
        table.read(tmp_path / "table.csv", LOAD)


def test_empty_cells_and_conditions_of_a_table(tmp_path: Path) -> None:
    content = "controller,load_kg,reference,rms_mm,bias_mm\npid,,,1.5,\npid,1.0,slow.csv,,0.2\n"
    (tmp_path / "table.csv").write_text(content)
    first, second = table.read(tmp_path / "table.csv", LOAD)
    assert (first.condition, first.figures) == (Condition(LOAD), {"rms_mm": 1.5})
    assert second.condition == Condition(1.0, tmp_path / "slow.csv")
    assert second.figures == {"bias_mm": 0.2}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("time_s,reference\n0,1\n1,2\n", "no column 'reference_mm'; did you mean"),
        ("time_s,reference_mm\n0,1\n", "1 samples"),
        ("time_s,reference_mm\n0,1\n0,2\n", "does not increase after 0 s"),
        ("time_s,reference_mm\n0,1\n5000,2\n", "is time_s in seconds"),
        ("time_s,reference_mm\n0,1\n1,x\n", "every line needs time_s and reference_mm"),
    ],
)
def test_faults_of_a_reference_name_value_and_remedy(
    tmp_path: Path, content: str, said: str
) -> None:
    (tmp_path / "path.csv").write_text(content)
    with pytest.raises(ValueError, match=said):
        references.read(tmp_path / "path.csv", PERIOD)


def test_samples_of_a_reference_hold_until_the_next(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("# a rig\ntime_s,reference_mm\n10.0,2\n10.02,5\n10.04,3\n")
    samples = references.read(tmp_path / "path.csv", PERIOD)
    assert samples == pytest.approx([0.002, 0.002, 0.005, 0.005, 0.003, 0.003])


def test_holds_are_random_and_within_their_range() -> None:
    holds, reach = Holds(200, 0.2, (0.002, 0.012)), (0.0, 0.016)
    first, second = (holds.samples(reach, seed, PERIOD) for seed in (0, 1))
    assert first.shape == (200 * 20,)
    assert (first == holds.samples(reach, 0, PERIOD)).all()
    assert (first != second).any()
    assert 0.002 <= first.min() < 0.003 < 0.011 < first.max() <= 0.012
    widest = Holds(200, 0.2).samples(reach, 0, PERIOD)
    assert 0.0016 <= widest.min() < widest.max() <= 0.0144


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"holds": Holds(0)}, "holds = 0 must be from 1"),
        ({"holds": Holds(1000)}, "at most 3600 s can be simulated"),
        ({"holds": Holds(5, 4.0, (0.01, 0.002))}, "range_mm = 10 2 must have the lower"),
        ({"runs": 2}, "runs = 2 must be from 3"),
        ({"settled": 0.0}, "settled_seconds = 0 must be"),
        ({"seed": -1}, "seed = -1"),
    ],
)
def test_settings_out_of_bounds_are_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        settings_of(**change)


def test_reference_beyond_the_reach_of_the_plant_is_refused(rig_data: Path) -> None:
    settings = settings_of(holds=Holds(3, 1.0, (0.002, 0.060)))
    (rig_data / "one.csv").write_text("controller,rms_mm\npid,1.0\n")
    with pytest.raises(ValueError, match=r"and the plant reaches 0 to 16.2 mm at 2.55 kg; give"):
        compare(settings, table.read(rig_data / "one.csv", LOAD))


def test_settled_bias_needs_holds(rig_data: Path) -> None:
    (rig_data / "bias.csv").write_text("controller,bias_mm\npid,1.0\n")
    measured = table.read(rig_data / "bias.csv", LOAD, rig_data / "path.csv")
    with pytest.raises(ValueError, match="bias_mm needs holds of at least 2 s"):
        compare(settings_of(), measured)


def test_figures_of_a_known_run() -> None:
    reference = np.repeat([0.001, 0.004], 100)
    reading = reference + np.repeat([0.0005, 0.0001, 0.002, -0.0003], 50)
    run = Run(reference, reading, np.full(200, 500.0), PERIOD, 0.5)
    found = {name: figure.of(run) for name, figure in FIGURES.items()}
    assert settled_parts(reference, PERIOD, 0.5) == [slice(50, 100), slice(150, 200)]
    assert settled_parts(reference, PERIOD, 0.6) == []
    assert found == pytest.approx(
        {
            "rms_mm": math.sqrt((0.25 + 0.01 + 4.0 + 0.09) / 4.0),
            "mae_mm": 2.9 / 4.0,
            "p95_mm": 2.0,
            "max_mm": 2.0,
            "bias_mm": 0.2,
            "travel_bar_s": 0.5,
        }
    )


def test_prediction_interval_holds_one_further_run() -> None:
    rng, held = np.random.default_rng(3), 0
    for _ in range(1000):
        runs = rng.normal(5.0, 1.0, 6)
        low, high = Prediction({"rms_mm": runs[:5]}).interval("rms_mm")
        held += low <= runs[5] <= high
    assert 930 <= held <= 970


def test_run_that_leaves_the_range_counts_as_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pam_envs.rig.comparison.prediction.ROOM", -0.8)
    found = predict(settings_of(), "random", Condition(0.0), [np.zeros(300)] * 3, ("rms_mm",))
    assert found.failed == 3
    assert math.isinf(found.mean("rms_mm"))
    assert all(math.isnan(end) for end in found.interval("rms_mm"))


def test_reach_shrinks_with_the_load() -> None:
    plant = SingleMuscle.mas10()
    assert reach_of(plant, 5.0)[1] < reach_of(plant, 0.0)[1]


def settings_of(**changes: Any) -> Settings:
    plant = SingleMuscle.mas10()
    given = {"plant": plant, "model": plant, "holds": Holds(3, 1.0), "settled": 1.0, "runs": 3}
    return Settings(**(given | changes))
