"""Hidden rigs: independence of the library, exact neutrality, physical plausibility."""

import ast
import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis import hidden
from tests.diagnosis.conftest import NOISE, base_of, effect_of, size
from tests.diagnosis.hidden import Campaign, Stepper

FOLDER = Path(hidden.__file__).parent
ALLOWED = {"numpy", "scipy", "numba", *sys.stdlib_module_names}
ALL = (*hidden.EFFECTS, *hidden.TUNING_UNKNOWN, *hidden.FINAL_UNKNOWN)


def single(command: np.ndarray, load: float = 0.0, period: float = 0.02) -> Campaign:
    count = command.size
    return Campaign(
        command,
        np.full(count, "test_a"),
        np.full(count, load),
        np.full(count, 20.0),
        np.zeros(count, bool),
        period,
    )


@pytest.fixture(scope="module")
def standard():
    return hidden.campaign_standard()


@pytest.fixture(scope="module")
def clean_short(short):
    return hidden.simulate(base_of(), [], short)


@pytest.fixture(scope="module")
def clean(standard):
    return hidden.simulate(base_of(), [], standard)


def _imports(tree: ast.AST) -> set[str]:
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add((node.module or "").partition(".")[0])
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 1, "only files of the same folder"
    return names


@pytest.mark.parametrize("folder", [FOLDER, FOLDER.with_name("worlds")], ids=lambda f: f.name)
def test_hidden_rigs_import_only_numpy_and_numba(folder):
    files = sorted(folder.rglob("*.py"))
    assert len(files) > 10
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        assert _imports(tree) <= ALLOWED, file.name
        words = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        assert not words & {"__import__", "importlib", "import_module", "exec", "eval"}, file.name


def test_there_are_25_effects_and_two_disjoint_sets_outside_the_catalogue():
    assert len(hidden.EFFECTS) == len(set(hidden.EFFECTS)) == 25
    assert len(hidden.TUNING_UNKNOWN) >= 4
    assert len(hidden.FINAL_UNKNOWN) >= 4
    assert len(set(ALL)) == len(ALL)


@pytest.mark.parametrize("name", ALL)
def test_zero_amplitude_is_exactly_clean(name, short, clean_short):
    base, effect = base_of(), effect_of(name)
    zero = hidden.simulate(base, [(effect, 0.0)], short)
    assert all(np.array_equal(clean_short[key], zero[key]) for key in clean_short)
    assert size(hidden.simulate(base, [(effect, 1e-4)], short), clean_short) < 0.1


@pytest.mark.parametrize("name", ALL)
def test_each_effect_is_visible_and_physical(name, short, clean_short):
    base, effect = base_of(), effect_of(name)
    shown = hidden.simulate(base, [(effect, 5.0)], short)
    assert size(shown, clean_short) > 1.0
    strong = hidden.simulate(base, [(effect, 15.0)], short)
    assert np.all(np.isfinite(strong["contraction_mm"]))
    assert size(strong, clean_short) > size(shown, clean_short)
    assert np.ptp(strong["contraction_mm"]) < 0.3 * base.length_mm
    assert -0.7 < strong["pressure_bar"].min() <= strong["pressure_bar"].max() < 9.0


def test_same_seeds_give_the_same_recording(short):
    def recording(noise_seed: int) -> dict:
        effects = [(effect_of("creep"), 2.0), (effect_of("leak"), 1.0)]
        return hidden.make_recording(base_of(), effects, short, noise_seed)

    one, same, other = recording(5), recording(5), recording(6)
    assert all(np.array_equal(one[key], same[key]) for key in one)
    assert not np.array_equal(one["contraction_mm"], other["contraction_mm"])
    assert base_of(4) == base_of(4) != base_of(5)
    assert effect_of("creep", 2) == effect_of("creep", 2) != effect_of("creep", 3)


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_noise_has_declared_size_and_slow_part(factor, standard, clean):
    base = dataclasses.replace(base_of(), coloured=0.5, grain_mm=0.0, grain_bar=0.0)
    noise = {name: [] for name in NOISE}
    for seed in range(4):
        columns = hidden.make_recording(base, [], standard, seed, factor)
        for name in NOISE:
            noise[name].append(columns[name] - clean[name])
    for name, rms in NOISE.items():
        rows = np.array(noise[name])
        assert np.sqrt(np.mean(rows**2)) == pytest.approx(factor * rms, rel=0.06)
        lagged = np.mean(rows[:, 50:] * rows[:, :-50]) / np.mean(rows**2)
        assert lagged == pytest.approx(0.5 * np.exp(-1.0), abs=0.08)


def test_campaign_has_every_kind_twice_under_four_loads_or_more(standard):
    kinds: dict[str, set] = {}
    for label in dict.fromkeys(standard.segment.tolist()):
        kinds.setdefault(label.rpartition("_")[0], set()).add(label)
    assert all(len(instances) >= 2 for instances in kinds.values())
    assert {"staircase", "triangle", "steps", "random", "holds", "shut", "chirp"} <= set(kinds)
    assert set(standard.load_N) == {0.0, 15.0, 30.0, 45.0, 60.0}
    assert 280.0 < standard.time[-1] < 320.0
    assert np.ptp(standard.temperature_C) > 2.0


def test_loads_change_in_rests_near_0_bar(standard, clean):
    changes = np.flatnonzero(np.diff(standard.load_N)) + 1
    assert changes.size > 6
    for row in changes:
        assert standard.segment[row].startswith("rest")
        assert np.all(standard.command_bar[row : row + 50] == 0.0)
        assert clean["pressure_bar"][row + 49] < 0.01


def test_repeated_segments_have_the_same_commands_and_loads(standard):
    for pair in standard.repeats():
        one, other = (standard.segment == label for label in pair)
        assert np.array_equal(standard.command_bar[one], standard.command_bar[other])
        assert np.array_equal(standard.load_N[one], standard.load_N[other])


def test_closed_valve_holds_pressure_without_leak(standard, clean):
    leaking = hidden.simulate(base_of(), [(effect_of("leak"), 5.0)], standard)
    assert standard.closed_segments() == ["shut_a", "shut_b"]
    for label, level in (("shut_a", 2.0), ("shut_b", 4.5)):
        rows = standard.segment == label
        assert rows.sum() == 500
        assert np.ptp(clean["pressure_bar"][rows]) == 0.0
        assert clean["pressure_bar"][rows][0] == pytest.approx(level, rel=0.05)
        assert leaking["pressure_bar"][rows][-1] < leaking["pressure_bar"][rows][0] - 0.1


def test_long_short_and_idle_campaigns(short):
    assert 570.0 < hidden.campaign_long().time[-1] < 630.0
    assert 110.0 < short.time[-1] < 130.0
    idle = hidden.campaign_idle()
    assert np.ptp(idle.command_bar) == 0.0
    assert np.ptp(hidden.simulate(base_of(), [], idle)["contraction_mm"]) < 0.01


def test_clean_regulator_is_a_first_order_lag():
    base = base_of()
    step = hidden.simulate(base, [], single(np.full(200, 3.0), period=0.01))
    expected = base.gain * 3.0 * (1.0 - np.exp(-step["time"] / base.lag))
    assert np.allclose(step["pressure_bar"], expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_loop_width_and_stroke_are_as_drawn(seed):
    base = base_of(seed)
    half = np.linspace(0.0, 6.0, 2000)
    run = hidden.simulate(base, [], single(np.concatenate([half, half[::-1], half, half[::-1]])))
    up, down = slice(4000, 6000), slice(6000, 8000)
    middle = 0.5 * run["contraction_mm"].max()
    rising = np.interp(middle, run["contraction_mm"][up], run["pressure_bar"][up])
    falling = np.interp(middle, run["contraction_mm"][down][::-1], run["pressure_bar"][down][::-1])
    assert rising - falling == pytest.approx(base.loop, abs=0.05)
    assert 0.12 < run["contraction_mm"].max() / base.length_mm < 0.2


def test_muscle_at_rest_moves_only_with_load_changes():
    base = base_of()
    steady = hidden.simulate(base, [], single(np.zeros(100), load=30.0))
    assert np.max(np.abs(steady["contraction_mm"])) < 1e-6
    changed = single(np.zeros(200))
    changed.load_N[50:] = 30.0
    assert hidden.simulate(base, [], changed)["contraction_mm"][-1] < -0.2


def test_decoys_are_outside_the_usual_range():
    rng = np.random.default_rng(0)
    for base in [hidden.draw_base(rng, decoy=True) for _ in range(20)]:
        assert not 0.035 <= base.lag <= 0.12
        assert not 0.97 <= base.gain <= 1.03
        assert not 0.15 <= base.mass <= 0.5
        assert not 0.4 <= base.loop <= 0.85


@pytest.mark.parametrize("name", ["dead_time", "creep", "stick_slip", "sensor_delay", "wire_slack"])
def test_stepped_rig_equals_campaign(name):
    rng = np.random.default_rng(0)
    command = np.repeat(rng.uniform(0.0, 5.0, 12), 40)
    base, effects = base_of(), [(effect_of(name), 3.0)]
    rows = hidden.simulate(base, effects, single(command, load=30.0, period=0.01))
    stepper = Stepper(base, effects, 30.0, 0, period=0.01, noise_factor=0.0)
    grain = max(base.grain_mm, 1e-9)
    for row, value in enumerate(command[:-1], start=1):
        place, pressure = stepper.step(value)
        assert stepper.position_mm == rows["position_mm"][row]
        assert place == pytest.approx(rows["contraction_mm"][row], abs=grain)
        assert pressure == pytest.approx(rows["pressure_bar"][row], abs=max(base.grain_bar, 1e-9))


def test_reset_restarts_rig_and_noise():
    stepper = Stepper(base_of(), [(effect_of("creep"), 3.0)], 15.0, noise_seed=4)
    first = [stepper.step(3.0) for _ in range(50)]
    stepper.reset(4)
    assert [stepper.step(3.0) for _ in range(50)] == first
    stepper.reset(5)
    assert [stepper.step(3.0) for _ in range(50)] != first


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: effect_of("magic"), "no effect is called 'magic'"),
        (lambda: effect_of("creep").strength(-1.0), r"amplitude -1\.0 of creep is negative"),
        (lambda: Stepper(base_of(), [], 0.0, 0, period=0.0125), r"period 0\.0125 s is not a whole"),
    ],
)
def test_impossible_rigs_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_rig_file_declares_the_constants(standard):
    base = base_of()
    sheet = hidden.rig_yaml(base, standard, noise_factor=3.0)
    assert sheet["plant"] == "single_muscle"
    assert sheet["muscle"] == {"rest_length_mm": base.length_mm, "diameter_mm": 10.0}
    assert ["holds_a", "holds_b"] in sheet["repeats"]
    assert sheet["valve_closed"] == ["shut_a", "shut_b"]
    assert sheet["sensors"]["contraction_noise_mm"] == pytest.approx(0.135)
