"""Identification of a muscle from quasi-static cycles of contraction against pressure.

The tables of positioning2021 (inflation and deflation at three loads, five times) determine the
static law and the shape of the major loop. Minor loops follow from a documented prior (equal weight
on every threshold); lag, dead time, slew rate, damping, moving mass and sensors stay assumed.

Maxwell-slip (play operators on the pressure) and static law are fitted together by least squares
on the mean contractions and on the three published loop widths. The Preisach map is then fitted to
the effective pressures that this static law needs for the same readings, so that switching the
hysteresis leaves the rest of the plant unchanged. Friction driven by length is fitted with its own
static law (:mod:`~pam_envs.identification.length_friction`).
"""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pam_envs.arrays import Array
from pam_envs.data.tables import ContractionTable
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.identification import length_friction as length
from pam_envs.identification.preisach_forc import PreisachFit, fit_preisach
from pam_envs.plants.single_muscle.hysteresis import Hysteresis, Kind
from pam_envs.plants.single_muscle.plant import SingleMuscle

THRESHOLDS = (1.0e4, 2.0e4, 3.5e4, 5.0e4, 7.5e4, 1.1e5)
"""Half dead widths of the play operators [Pa]; the readings are 0.5 bar apart."""
STATIC = ("area", "braid_force", "braid_strain", "stiffness", "hardening")
_START = np.array([8.7e-4, 106.0, 0.0168, 2250.0, 8000.0, 0.12, *[1 / 6] * 6, 0.3, -0.055])
_LOW = np.array([1e-4, 1.0, 0.006, 100.0, 0.0, 0.10, *[0.0] * 6, -0.7, -0.15])
_HIGH = np.array([5e-3, 2e3, 0.2, 2e4, 1e6, 0.90, *[5.0] * 6, 0.7, 0.05])
_SCALE = np.array([6e-4, 100.0, 0.02, 1e3, 1e4, 0.1, *[0.2] * 6, 0.3, 0.05])
WIDTH_WEIGHT = 2.0  # a loop width counts as much as this many readings (times their weight)
PRIOR_WEIGHT = 0.1
"""Penalty [mm] on a threshold's share of the weight that is twice, or none of, the prior's."""
LEVELS = 49  # levels of the Everett map from -6 to 6 bar: one every 0.25 bar
_LEAST_SLOPE = 0.1
_SOURCE = "identified on positioning2021, Tables 3-5"


@dataclass(frozen=True)
class Cycles:
    """Mean cycles: loads (n,) [kg], pressures (T,) [Pa] in order, mean contractions (n, T) [m]."""

    loads: Array
    pressures: Array
    contractions: Array

    @property
    def turn(self) -> int:
        """Index of the highest pressure."""
        return int(np.argmax(self.pressures))

    def widths(self, contractions: Array | None = None) -> Array:
        """Return deflating minus inflating contraction [m], shape (n, pressures below the turn)."""
        x = self.contractions if contractions is None else contractions
        return np.asarray(x[:, self.turn + 1 :] - x[:, self.turn - 1 :: -1])

    def widest(self) -> NDArray[np.int64]:
        """Return, for each load, the column of :meth:`widths` with the widest measured loop."""
        return np.asarray(np.argmax(self.widths(), axis=1))


@dataclass(frozen=True)
class CyclesFit:
    """A plant fitted to cycles, and its residual, model minus mean reading [m], shape (n, T)."""

    plant: SingleMuscle
    cycles: Cycles
    residual: Array
    preisach: PreisachFit | None = None

    def rms(self, load: float | None = None) -> float:
        """Return the root mean square residual [m] over one load or all (zeroed cells left out)."""
        pick = self.residual if load is None else self.residual[self.cycles.loads == load]
        return float(np.sqrt(np.mean(pick[:, 1:] ** 2)))

    def widths(self) -> tuple[Array, Array, Array]:
        """Return pressures [Pa] of the widest measured loops, those widths and the model's [m]."""
        c, columns = self.cycles, self.cycles.widest()
        rows = np.arange(len(c.loads))
        model = c.widths(c.contractions + self.residual)[rows, columns]
        return c.pressures[c.turn + 1 :][columns], c.widths()[rows, columns], model


def mean_cycles(table: ContractionTable, repeats: Any = None) -> Cycles:
    """Return the mean cycles over some repeats (all by default; an array may repeat itself)."""
    chosen = np.unique(table.repeat) if repeats is None else np.asarray(repeats)
    loads = np.array(sorted(table.loads), float)
    cycles = [[table.cycle(m, int(r)) for r in chosen] for m in loads]
    pressures = np.asarray(cycles[0][0][0], float)
    means = [np.mean([x for _, x in several], axis=0) for several in cycles]
    return Cycles(loads, pressures, np.array(means))


def quasi_static(plant: SingleMuscle, pressures: Array, load: float) -> Array:
    """Return the contractions [m] of a virgin muscle along slow changes of pressure [Pa]."""
    full = plant.regulator.max_pressure
    operator = plant.operator_at(load)
    drive = np.asarray(pressures, float)
    if operator is not None:
        felt, _ = operator.simulate(plant.hysteresis.stretched(drive, full))
        drive = plant.hysteresis.unstretched(felt, full)
    return plant.contraction_at(drive, load)


def _plant(theta: Array, hysteresis: bool) -> SingleMuscle:
    base = SingleMuscle()
    muscle = dataclasses.replace(
        base.muscle, **{k: float(v) for k, v in zip(STATIC, theta, strict=False)}
    )
    held = Hysteresis()
    if hysteresis:
        shares = theta[6:12] / max(float(theta[6:12].sum()), 1e-9)
        weights = tuple(float(w) for w in (1.0 - theta[5]) * shares)
        operator = PlayOperator(THRESHOLDS, weights, 1.0 - float(np.sum(weights)))
        held = Hysteresis(
            operator=operator, stretch=float(theta[12]), width_per_load=float(theta[13])
        )
    return dataclasses.replace(base, muscle=muscle, hysteresis=held)


def _model(plant: SingleMuscle, cycles: Cycles) -> Array:
    return np.array([quasi_static(plant, cycles.pressures, m) for m in cycles.loads.tolist()])


def _residuals(theta: Array, cycles: Cycles, hysteresis: bool, prior: Array) -> Array:
    made = _model(_plant(theta, hysteresis), cycles)
    parts = [1e3 * (made - cycles.contractions)[:, 1:].ravel()]
    if hysteresis:
        rows, columns = np.arange(len(cycles.loads)), cycles.widest()
        width = (cycles.widths(made) - cycles.widths())[rows, columns]
        parts += [WIDTH_WEIGHT * 1e3 * width, PRIOR_WEIGHT * (theta[6:12] / prior - 1.0)]
    return np.concatenate(parts)


def fit_maxwell_slip(
    cycles: Cycles, hysteresis: bool = True, prior: Array | None = None, start: Array | None = None
) -> tuple[CyclesFit, Array]:
    """Fit static law and play operators, or, without hysteresis, the static law alone.

    ``prior`` are the shares of the thresholds (6,) to which the weights are drawn, equal by
    default. Returns the fit and its parameters, a start for neighbouring fits.
    """
    shares = np.full(6, 1 / 6) if prior is None else np.maximum(prior, 1e-3)
    begin = _START if start is None else start
    free = np.arange(len(_START)) if hysteresis else np.arange(len(STATIC))

    def residuals(part: Array) -> Array:
        theta = begin.copy()
        theta[free] = part
        return _residuals(theta, cycles, hysteresis, shares)

    found = least_squares(
        residuals,
        np.clip(begin[free], _LOW[free] + 1e-9, _HIGH[free] - 1e-9),
        bounds=(_LOW[free], _HIGH[free]),
        x_scale=_SCALE[free],
        max_nfev=60,
    )
    theta = begin.copy()
    theta[free] = found.x
    plant = _plant(theta, hysteresis)
    return CyclesFit(plant, cycles, _model(plant, cycles) - cycles.contractions), theta


def fit_preisach_map(fit: CyclesFit, prior_weight: float = 1e-2) -> CyclesFit:
    """Return the plant of ``fit`` with its hysteresis replaced by a Preisach operator.

    The operator's output at a reading is the effective pressure that the static law needs for it,
    its hysteretic part brought to load 0; the loads are averaged.
    """
    plant, c = fit.plant, fit.cycles
    full = plant.regulator.max_pressure
    width = np.maximum(0.1, 1.0 + plant.hysteresis.width_per_load * c.loads)[:, None]
    drive = plant.drive_for(c.contractions, c.loads[:, None])
    outputs = c.pressures - (c.pressures - drive) / width
    weights = np.broadcast_to(width**2, outputs.shape).copy()
    for row, column in enumerate(c.widest()):  # the same emphasis as in the fit of the plays
        weights[row, [c.turn + 1 + column, c.turn - 1 - column]] *= 1.0 + WIDTH_WEIGHT**2
    target = np.average(outputs, axis=0, weights=weights) / 1e5
    x = c.pressures / 1e5
    found = fit_preisach(
        x,
        target - _LEAST_SLOPE * x,
        -full / 1e5,
        full / 1e5,
        levels=LEVELS,
        start="virgin",
        prior_weight=prior_weight,
    )
    table = np.array(found.model.plus_linear(_LEAST_SLOPE).table) * 1e5
    operator = Preisach(-full, full, table.tolist(), start="virgin")
    hysteresis = dataclasses.replace(plant.hysteresis, operator=operator, stretch=0.0)
    made = dataclasses.replace(plant, hysteresis=hysteresis)
    return CyclesFit(made, c, _model(made, c) - c.contractions, found)


def fit_cycles(cycles: Cycles, hysteresis: Kind = "maxwell_slip") -> CyclesFit:
    """Fit a muscle with that hysteresis to cycles."""
    if hysteresis == "none":
        return fit_maxwell_slip(cycles, hysteresis=False)[0]
    if hysteresis in length.CELLS:
        return fit_by_length(cycles, hysteresis)
    fit, _ = fit_maxwell_slip(cycles)
    return fit if hysteresis == "maxwell_slip" else fit_preisach_map(fit)


def fit_by_length(cycles: Cycles, hysteresis: Kind, prior: Array | None = None) -> CyclesFit:
    """Fit a muscle with friction driven by length; ``prior`` as of :func:`fit_maxwell_slip`."""
    c = cycles
    plant = length.fit_length_friction(
        c.pressures, c.loads, c.contractions, c.widest(), hysteresis, WIDTH_WEIGHT, prior
    )
    return CyclesFit(plant, c, _model(plant, c) - c.contractions)


def ensemble(
    table: ContractionTable, hysteresis: Kind, best: CyclesFit, members: int = 8, seed: int = 0
) -> tuple[Mapping[str, Any], ...]:
    """Return parameter sets that fit the readings about as well as the best one.

    Each is fitted to resampled repeats, with its own prior for what the readings do not fix, and
    kept if its residual on all readings is at most a tenth larger than the best fit's.
    """
    random, kept = np.random.default_rng(seed), list[Mapping[str, Any]]()
    by_length = hysteresis in length.CELLS
    start = None if by_length else fit_maxwell_slip(best.cycles, hysteresis != "none")[1]
    for _ in range(4 * members):
        if len(kept) == members:
            break
        repeats = random.choice(np.unique(table.repeat), 5)
        prior = random.dirichlet(np.full(6, 2.0))
        means = mean_cycles(table, repeats)
        if by_length:
            fit = fit_by_length(means, hysteresis, prior)
        else:
            fit, _ = fit_maxwell_slip(means, hysteresis != "none", prior, start)
        if hysteresis == "preisach":
            fit = fit_preisach_map(fit)
        missed = _model(fit.plant, best.cycles) - best.cycles.contractions
        if np.sqrt(np.mean(missed[:, 1:] ** 2)) <= 1.1 * best.rms():
            kept.append(_member(fit.plant))
    return tuple(kept)


def _friction(drive: str) -> list[str]:
    """Return the identified parameters that are particular to a drive of the hysteresis."""
    if drive == "length":
        names = ("friction", "limit_per_pressure", "limit_per_load")
        return ["muscle.area_taper", *(f"hysteresis.{name}" for name in names)]
    return ["hysteresis.stretch", "hysteresis.width_per_load"]


def _member(plant: SingleMuscle) -> Mapping[str, Any]:
    names = [*(f"muscle.{k}" for k in STATIC), *_friction(plant.hysteresis.drive)]
    values: dict[str, Any] = {name: plant.value(name) for name in names}
    if plant.hysteresis.operator is not None:
        values["hysteresis.operator"] = plant.hysteresis.operator
    return values


def identify_mas10(
    table: ContractionTable, hysteresis: Kind, members: int = 8
) -> tuple[SingleMuscle, CyclesFit]:
    """Return the shipped MAS-10 plant with that hysteresis, and its fit."""
    fit = fit_cycles(mean_cycles(table), hysteresis)
    names = {*(f"muscle.{k}" for k in (*STATIC, "area_taper"))}
    names |= set(_friction(fit.plant.hysteresis.drive)) if hysteresis != "none" else set()
    plant = dataclasses.replace(
        fit.plant,
        provenance={name: ("identified", _SOURCE) for name in names},
        ensemble=ensemble(table, hysteresis, fit, members),
    )
    return plant, fit


def _left_out_rms(table: ContractionTable, model: Callable[[Cycles, Cycles], Array]) -> float:
    """Return the RMS error [m] on each repeat in turn of a model fitted to the other repeats."""
    repeats, missed = np.unique(table.repeat), []
    for held in repeats:
        others, left = mean_cycles(table, repeats[repeats != held]), mean_cycles(table, [held])
        missed.append((model(others, left) - left.contractions)[:, 1:])
    return float(np.sqrt(np.mean(np.square(missed))))


def leave_one_repeat_out(table: ContractionTable, hysteresis: Kind) -> float:
    """Return the RMS error [m] on a repeat of plants fitted to the others."""
    return _left_out_rms(
        table, lambda others, left: _model(fit_cycles(others, hysteresis).plant, left)
    )


def repeatability_floor(table: ContractionTable) -> float:
    """Return the RMS difference [m] of a repeat from the mean of the others."""
    return _left_out_rms(table, lambda others, left: others.contractions)


@dataclass(frozen=True)
class Identifiability:
    """Identifiability of a plant's parameters from the cycles."""

    names: tuple[str, ...]
    # combinations that the means determine to better than a fifth (one standard deviation)
    rank: int
    fixed: Array  # share of each parameter in them, from 0 to 1


def identifiability(fit: CyclesFit, standard_error: float = 6.7e-5) -> Identifiability:
    """Return the identifiability of a Maxwell-slip fit (``standard_error`` in m)."""
    plant, base = fit.plant, _model(fit.plant, fit.cycles)
    operator: Any = plant.hysteresis.operator
    if plant.hysteresis.kind != PlayOperator.kind:
        raise ValueError(f"a Maxwell-slip fit is needed, this one has {plant.hysteresis.kind!r}")
    from pam_envs.plants.single_muscle.rows import PARAMETERS

    other = ("position", "pressure", *_friction("length")[1:])
    names = [n for n in PARAMETERS if not n.startswith(other)]
    columns = []
    for name in names:
        value = plant.value(name)
        step = 0.02 * value if value else 0.02
        try:
            moved = plant.replace({name: value + step})
        except ValueError:
            moved, step = plant.replace({name: value - step}), -step
        columns.append((_model(moved, fit.cycles) - base) * (0.2 * (value or 1.0) / step))
    for k in range(len(THRESHOLDS)):
        weights = np.array(operator.weights)
        change = 0.02 * weights.mean()
        weights[k] += change
        scaled = weights * (1.0 - operator.linear) / weights.sum()
        moved = plant.replace(
            {"hysteresis.operator": PlayOperator(THRESHOLDS, tuple(scaled), 1.0 - scaled.sum())}
        )
        columns.append((_model(moved, fit.cycles) - base) * 10.0)
    names += [f"hysteresis.weight[{k}]" for k in range(len(THRESHOLDS))]
    matrix = np.array([c[:, 1:].ravel() for c in columns]).T / standard_error
    _, sizes, directions = np.linalg.svd(matrix, full_matrices=False)
    strong = sizes > 1.0
    return Identifiability(tuple(names), int(strong.sum()), np.sum(directions[strong] ** 2, axis=0))
