"""Catalogue of causes: completeness, documentation, effect on the plant."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import causes as package
from pam_envs.diagnosis.cause import NEEDS
from pam_envs.diagnosis.causes import by_name, catalogue, selected
from pam_envs.diagnosis.fit.candidate import frees_for
from pam_envs.diagnosis.fit.single_muscle import BASE, MuscleFamily, start_plant
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import Inputs, replay
from tests.diagnosis import hidden
from tests.diagnosis.causes import causes_page as page
from tests.diagnosis.causes import users_cause

CATALOGUE = catalogue()
NAMES = [cause.name for cause in CATALOGUE]
PUBLISHED = set(hidden.EFFECTS)
"""Names that reports already use; further causes may follow."""
FILES = [p for p in Path(package.__file__).parent.rglob("*.py") if p.name != "__init__.py"]
PLANT = start_plant(Rig(rest_length=0.2))
PERIOD = 0.02
EARLY = {"position.slip_at": 8.0, "position.ramp_at": 8.0, "pressure.ramp_at": 8.0}
"""Times [s] within the short campaign, for those that are searched in a recording."""
FORMS = [
    pytest.param(cause, form, id=f"{cause.name}-{form.name}")
    for cause in CATALOGUE
    for form in cause.forms
]
TERMS = [
    pytest.param(form, term, id=f"{cause.name}-{form.name}-{term.name}")
    for cause in CATALOGUE
    for form in cause.forms
    for term in form.terms
]


def campaign(loads: tuple[float, float] = (1.5, 4.0)) -> Inputs:
    """Return 22 s of steps, small swings and a shut valve, twice, while the muscle warms."""
    bars = [(0, 0.6), (3, 1.4), (0.5, 1), (6, 1.4), (3, 1.4), (3.04, 0.6), (4.5, 0.8), (-1, 1.8)]
    bars += [(0.2, 1), (0, 1)]
    one = np.concatenate([np.full(round(s / PERIOD), 1e5 * p if p >= 0 else -1.0) for p, s in bars])
    command = np.tile(one, 2)
    n = len(command)
    fresh = np.zeros(n, bool)
    fresh[0] = True
    return Inputs(
        PERIOD,
        command,
        np.repeat(loads, len(one)),
        293.15 + np.linspace(0.0, 15.0, n),
        fresh,
        np.zeros(n),
        np.zeros(n, bool),
    )


def needing(word: str) -> list[str]:
    """Return the causes that need something of a recording."""
    return [cause.name for cause in CATALOGUE if word in cause.needs]


INPUTS, EMPTY = campaign(), campaign((0.0, 0.0))


@pytest.fixture(scope="module")
def plain():
    return replay(PLANT, INPUTS)


def started(form, **amounts):
    """Return the starting values of a form's last fit."""
    values = {t.name: EARLY.get(t.name, t.starts[-1]) for t in form.terms}
    return {**values, **amounts}


def neutral(form):
    """Return the values that switch a form off; parameters that only shape it are kept."""
    return {t.name: PLANT.declaration(t.name).neutral for t in form.terms if t.amount}


def differences(first, second):
    return {name: float(np.abs(first[name] - second[name]).max()) for name in first}


def test_catalogue_is_sorted_and_keeps_published_names():
    assert sorted(set(NAMES)) == NAMES
    assert set(NAMES) >= PUBLISHED


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_each_file_declares_the_cause_of_its_name(path):
    module = ".".join(path.relative_to(Path(package.__file__).parents[3]).with_suffix("").parts)
    assert importlib.import_module(module).CAUSE is by_name(path.stem)


def test_unknown_cause_name_is_refused():
    with pytest.raises(ValueError, match="no cause named 'gremlins'; known: creep, dead_time"):
        by_name("gremlins")
    with pytest.raises(ValueError, match=r"no cause named 'leek'; did you mean 'leak'\?"):
        by_name("leek")


def test_causes_are_selected_by_name_or_value():
    assert selected() == CATALOGUE
    assert selected(["leak", users_cause.CAUSE]) == (by_name("leak"), users_cause.CAUSE)
    with pytest.raises(ValueError, match="did you mean 'creep'"):
        selected(["creap"])
    with pytest.raises(ValueError, match="'leak' twice"):
        selected(["leak", by_name("leak")])
    with pytest.raises(ValueError, match="causes is empty"):
        selected([])
    with pytest.raises(TypeError, match="give a list of causes or names"):
        selected("leak")
    with pytest.raises(TypeError, match="causes holds 3"):
        selected([3])


def test_causes_upstream_of_the_pressure():
    assert {c.name for c in CATALOGUE if c.in_valve} == {
        "leak",
        "valve_dead_band",
        "dead_time",
        "slew_limit",
        "supply_droop",
        "exhaust_asymmetry",
    }


@pytest.mark.parametrize("cause", CATALOGUE, ids=NAMES)
def test_cause_is_documented(cause):
    for text in (cause.title, cause.signature, cause.experiment, cause.source, cause.sensor):
        assert text.strip()
    assert "\n\n" in page.documentation(cause)


@pytest.mark.parametrize("cause", CATALOGUE, ids=NAMES)
def test_neighbours_are_mutual(cause):
    assert cause.neighbours
    assert len(set(cause.neighbours)) == len(cause.neighbours)
    for name in cause.neighbours:
        assert name != cause.name
        assert cause.name in by_name(name).neighbours, f"{name} does not know {cause.name}"


def test_requirements_of_causes_have_words():
    assert {n for cause in CATALOGUE for n in cause.needs} <= set(NEEDS)
    for word in ("loads", "temperature"):
        assert all("contraction" in by_name(name).needs for name in needing(word))
    assert needing("temperature") == ["temperature"]
    assert needing("weighed") == ["payload_error"]


@pytest.mark.parametrize(("form", "term"), TERMS)
def test_starting_values_are_within_bounds(form, term):
    d = PLANT.declaration(term.name)
    low = d.low if term.low is None else term.low
    high = d.high if term.high is None else term.high
    assert d.low <= low < high <= d.high
    assert term.starts
    assert all(low <= start <= high for start in term.starts)
    assert not term.log or low > 0.0
    assert term.log or (term.scale is not None and term.scale > 0.0)
    assert {len(t.starts) for t in form.terms} <= {1, max(len(t.starts) for t in form.terms)}


@pytest.mark.parametrize(("cause", "form"), FORMS)
def test_each_form_has_an_amount_with_neutral_value(cause, form):
    off = neutral(form)
    assert off
    for term in form.terms:
        assert not term.amount or off[term.name] is not None
        assert not term.amount or off[term.name] not in term.starts
        assert term.name not in BASE


@pytest.mark.parametrize("name", page.parameters())
def test_every_parameter_is_in_one_class(name):
    assert [kind for kind, _ in page.classes_of(name)] in (["base"], ["cause"], ["declared"])
    assert {*page.named_by(), *page.GIVEN, *BASE} <= set(R.NAMES)


@pytest.mark.parametrize("name", page.PARTS)
def test_page_matches_the_declarations(name):
    assert page.part(name) == page.PARTS[name](), "run python -m tests.diagnosis.causes.causes_page"


@pytest.mark.parametrize(("cause", "form"), FORMS)
def test_each_form_changes_the_readings(cause, form, plain):
    changed = differences(plain, replay(PLANT.replace(started(form)), INPUTS))
    assert changed["contraction"] > 5e-6 or changed["pressure"] > 100.0


@pytest.mark.parametrize(("form", "term"), TERMS)
def test_each_parameter_of_a_form_changes_the_readings(form, term):
    values = started(form)
    span = abs(values[term.name]) or term.scale
    moved = values[term.name] + (0.3 * span if term.high is None else -0.3 * span)
    first = replay(PLANT.replace(values), INPUTS)
    second = replay(PLANT.replace({**values, term.name: moved}), INPUTS)
    assert max(differences(first, second).values()) > 0.0


@pytest.mark.parametrize(("cause", "form"), FORMS)
def test_neutral_cause_changes_no_bit(cause, form, plain):
    off = replay(PLANT.replace(started(form, **neutral(form))), INPUTS)
    for name, values in plain.items():
        assert np.array_equal(off[name], values)


@pytest.mark.parametrize("name", needing("contraction"))
def test_muscle_causes_leave_pressure_unchanged(name, plain):
    for form in by_name(name).forms:
        changed = replay(PLANT.replace(started(form)), INPUTS)
        assert np.array_equal(changed["pressure"], plain["pressure"])


@pytest.mark.parametrize("name", needing("loads"))
def test_load_causes_have_no_effect_without_load(name):
    empty = replay(PLANT, EMPTY)
    for form in by_name(name).forms:
        changed = replay(PLANT.replace(started(form)), EMPTY)
        assert np.array_equal(changed["contraction"], empty["contraction"])


def test_leak_lowers_pressure_with_valve_closed(plain):
    shut = INPUTS.command < 0.0
    leaking = replay(PLANT.replace(started(by_name("leak").forms[0])), INPUTS)
    still, falling = plain["pressure"][1:][shut[:-1]], leaking["pressure"][1:][shut[:-1]]
    half = len(still) // 2
    assert np.ptp(still[:half]) < 1.0
    assert (np.diff(falling[:half]) < 0.0).all()


def test_exhaust_asymmetry_acts_on_deflation_only():
    inputs = campaign()
    rising = np.maximum.accumulate(np.maximum(inputs.command, 0.0))
    up = Inputs(
        PERIOD, rising, inputs.load, inputs.kelvin, inputs.fresh, 0.0 * rising, inputs.rezeroed
    )
    first = replay(PLANT, up)["pressure"]
    for form in by_name("exhaust_asymmetry").forms:
        assert np.array_equal(replay(PLANT.replace(started(form)), up)["pressure"], first)


@pytest.mark.parametrize(("cause", "form"), FORMS)
def test_plant_with_a_cause_survives_yaml(cause, form, tmp_path):
    plant = PLANT.replace(started(form))
    plant.to_yaml(tmp_path / "plant.yaml")
    assert SingleMuscle.from_yaml(tmp_path / "plant.yaml") == plant


# --- a user's own -------------------------------------------------------------------------------


def test_users_cause_of_an_unused_parameter_changes_contraction_only(plain):
    form = users_cause.CAUSE.forms[0]
    assert users_cause.CAUSE.name not in NAMES
    assert not {t.name for t in form.terms} & {*page.named_by(), *BASE}
    changed = replay(PLANT.replace(started(form)), INPUTS)
    assert differences(plain, changed)["contraction"] > 5e-6
    assert np.array_equal(changed["pressure"], plain["pressure"])
    off = replay(PLANT.replace(neutral(form)), INPUTS)
    assert np.array_equal(off["contraction"], plain["contraction"])


def test_users_cause_is_fitted_like_shipped_ones():
    family = MuscleFamily(PLANT, INPUTS)
    form = users_cause.CAUSE.forms[0]
    (free,) = frees_for(family, form, (0.4,))
    assert (free.low, free.high) == (0.0, 1.0)
    column = family.column.copy()
    column[free.place] = free.outer(np.array([free.inner(0.4)]))[0]
    seen = family.simulate(column[None])
    replayed = replay(PLANT.replace({"mass.carried": 0.4}), INPUTS)
    np.testing.assert_array_equal(seen[0, :, 0], replayed["contraction"])
