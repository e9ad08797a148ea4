"""Equations, tables and statements of the papers that are checked by themselves, without a run."""

import numpy as np

from baselines.positioning import contraction_tables as curves
from benchmarks.papers.elbow import bundle
from benchmarks.papers.published import Group, Values, as_published
from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.tables import load_contraction_table
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.single_muscle.plant import SingleMuscle

# --- knee orthosis ------------------------------------------------------------------------------

NOMINAL = np.radians(110.0)
"""Angle [rad] of the assumed brace at the paper's nominal length of 22 cm."""


def brace() -> Values:
    """Balance of torques, length and tension of the brace, law of the braid."""
    plant = as_published(KneeOrthosis.rig("maxwell_slip"))
    lever, h = plant.lever, 1e-6
    slope = float(lever.length(NOMINAL + h) - lever.length(NOMINAL - h)) / (2.0 * h)
    cosine = np.cos(0.5 * NOMINAL)
    yield "dL/dtheta over L_b cos(theta / 2)", slope / (lever.arm * cosine)
    yield "lever arm of Eq. (3) over that of cos2", 1.0 / cosine
    printed = lever.stiffness * (NOMINAL - lever.relaxed_angle) / (lever.arm * cosine)
    yield "tension without assistance as printed", printed
    yield "tension without assistance at 22 cm", float(lever.tension(0.0, NOMINAL))
    stiffness = plant.muscle.stiffness_ratio * np.array([1e5, 2e5])
    tension = plant.muscle.tension(stiffness, plant.fixture.length)
    yield "tension at 2 bar and 22 cm", float(tension[1])
    yield "tension at 2 bar over that at 1 bar", float(tension[1] / tension[0])
    thread, turns, length = 0.25, 1.5, 0.2

    def volume(at: float) -> float:
        return (thread**2 - at**2) * at / (4.0 * np.pi * turns**2)

    work = -(volume(length + h) - volume(length - h)) / (2.0 * h)
    law = np.pi * thread**2 / (4.0 * np.pi * turns**2) * (3.0 * length**2 / thread**2 - 1.0)
    yield "force of Eq. (5) over that of virtual work", law / work


# --- elbow orthosis -----------------------------------------------------------------------------

AT_REST = {1: 14.0, 7: 111.0}
"""Muscles: force [N] at nominal length and zero pressure."""


def bundles() -> Values:
    """Force and stiffness of bundles: Eqs. (4), (5) and (7), and statements on them."""
    three, p = bundle(3), 4e5
    c = np.linspace(0.0, 0.9 * three.reach, 50)
    length, least = three.nominal_length - c, three.nominal_length - three.reach
    simple = three.pressure_factor * p * length * (length - least)
    off = float(np.abs((three.law(p, c) - three.law(0.0, c)) / simple - 1.0).max())
    yield "Eq. (5) without k0 over Eq. (4), less 1", off
    h = 1e-6
    slope = (three.law(p, c + h) - three.law(p, c - h)) / (2.0 * h)
    worst = float(np.abs(slope / three.stiffness(p, c) - 1.0).max())
    yield "Eq. (7) over a finite difference, less 1", worst
    bends = [
        np.diff(three.stiffness(p, c), 2),
        np.diff(three.stiffness(np.linspace(0.0, 6e5, 9), 0.05), 2),
        np.diff([float(bundle(n).stiffness(p, 0.05)) for n in range(1, 8)], 2),
    ]
    bend = max(float(np.abs(b).max()) for b in bends) / float(np.abs(three.stiffness(p, 0.0)))
    yield "second difference of the stiffness", bend
    stiff = np.diff([-float(bundle(n).stiffness(p, 0.0)) for n in range(1, 7)])
    yield "least gain of stiffness by a muscle", float(stiff.min())
    for n, value in AT_REST.items():
        ours, known = float(bundle(n, 0.33).law(0.0, 0.0)), {"n": n, "expected": value}
        yield "force of {n} at 0 kPa and nominal length", ours, known
    for share in (24, 32):
        at = 0.01 * share * bundle(1).nominal_length
        ours = float(bundle(1).law(5e5, at) - bundle(1).law(0.0, at))
        yield f"gain of force by filling at {share} %", ours


# --- antagonistic joint -------------------------------------------------------------------------


def joint_geometry() -> Values:
    """Lengths of the muscles over the angle, and the inverse of the static map."""
    plant = as_published(AntagonisticJoint.paper("maxwell_slip"))
    ends = np.sort(1e3 * (plant.lever.length(np.radians(30.0)) + plant.lever.fittings))
    yield "shortest distance of the ends of a muscle at 30 degrees", float(ends[0])
    yield "longest distance of the ends of a muscle at 30 degrees", float(ends[1])
    rest = plant.muscle.rest_length
    share = 100.0 * float(np.max(plant.lever.contraction(np.radians(30.0), rest)))
    yield "contraction at 30 degrees", share
    angle = np.radians(np.linspace(-25.0, 25.0, 51))
    a, b, missed = plant.pressures_for(angle)
    torque = float(np.abs(plant.torque(angle, a, b)[~missed]).max())
    yield "torque left by the inverse map", torque


# --- single muscle ------------------------------------------------------------------------------

LOADS = {0.0: "Table 3; section 3.1.1: standard deviations", 2.55: "Table 4", 4.55: "Table 5"}
PRINTED_MEANS = {
    0.0: "0 .41 1 1.6 2.7 3.7 5.2 7.1 8.6 10.18 11.92 12.8 15.1 14.5 13.9 12.7 11.6 10.39 8.22 6.2 "
    "4.6 3.2 1.9 1 .31",
    2.55: "0 .3 1.1 1.5 2.4 3.5 5.1 6.92 8.38 9.58 11.62 12.48 14.78 14.5 13.6 12.4 10.9 9.4 7.5 "
    "5.6 4.2 2.7 1.8 .9 .3",
    4.55: "0 .1 .5 1 1.9 3 4.4 5.8 7.6 9.7 11.3 12.8 14 13.3 12.4 11.4 9.8 8.2 6.5 4.8 3.5 2.2 1.4 "
    ".5 .2",
}
"""Column "Arithmetic Mean" of Tables 3 to 5 [mm]."""
PRINTED_DEVIATIONS = {
    0.0: "0 .04427 .06325 .10488 .22804 .24495 .28983 .14142 .14142 .19391 .13266 .10954 .14142 "
    ".22803 .14142 .15165 .10954 .06633 .13266 .14142 .15491 .18973 .16733 .14142 .06633",
    2.55: "0 .08944 .14142 .08944 .14142 .08944 .08944 .11662 .07483 .11662 .11662 .11662 .07483 "
    ".27568 .08944 .06325 .08944 .14142 .06325 .10954 .14142 .14142 .08944 .08944 .12649",
    4.55: "0 .06325 .10954 .06325 .10954 .06325 .24495 .06325 .14142 .10954 .12649 .08944 .06325 "
    ".08944 .08944 .08944 .06325 .08944 .08944 .17889 .14142 .17889 .22804 .10954 .06325",
}
"""Column "Standard Deviation" of Tables 3 to 5 [mm]."""
DETERMINATIONS = (
    (0.998, "Fig. 5; section 3.1.1: r2 of inflation", ""),
    (0.998, "Fig. 6; section 3.1.1: r2 of deflation", ""),
    (0.997, "Fig. 8; section 3.1.2: r2", "a copy of Eq. (1); its own refit has 0.997"),
    (0.999, "Fig. 8; section 3.1.2: r2", ""),
    (0.999, "Fig. 10; section 3.1.3: r2", "0.6 mm low above 4 bar: its own refit has 0.999"),
    (0.999, "Fig. 10; section 3.1.3: r2", ""),
)
"""Determination printed with Eqs. (1) to (6), its other places, reason of a difference."""
REFITTED = (0.057, 0.063, 0.051, 0.019, 0.074, 0.030)
"""RMS error [bar] on Table 6 of cubics fitted to it in full precision, by another program."""
SUSPECT = {(2, 0, 0), (0, 1, 0)}
"""Load, branch and row of the entries of Table 6 that are not on the curves of Tables 3 to 5."""


def numbers(text: str) -> Array:
    """Return the numbers of a printed column."""
    return np.array([float(word) for word in text.split()])


def determination(cubic: Array, x: Array, y: Array) -> tuple[float, float]:
    """Return the coefficient of determination and the RMS error of a cubic on pairs."""
    error = np.polyval(cubic, x) - y
    spread = np.sum((y - y.mean()) ** 2)
    return float(1.0 - np.sum(error**2) / spread), float(np.sqrt(np.mean(error**2)))


def table_statistics() -> Values:
    """Means and standard deviations of Tables 3 to 5, and statements on the readings."""
    table = load_contraction_table()
    steps, tops = list[float](), list[float]()
    for load, place in LOADS.items():
        readings, at = table.cycles(load)[1] / MM, {"load": load, "source": place}
        off = float(np.abs(readings.mean(axis=1) - numbers(PRINTED_MEANS[load])).max())
        mean = at | {"source": place.partition(";")[0]}
        yield "{load:g} kg: largest difference of a printed mean", off, mean
        off = float(np.abs(readings.std(axis=1) - numbers(PRINTED_DEVIATIONS[load])).max())
        yield "{load:g} kg: largest difference of a printed deviation", off, at
        inflated = table.branch(load, True)[1].mean(axis=1) / MM
        steps, tops = [*steps, *np.diff(inflated)], [*tops, float(inflated[-1])]
    least = float(min(steps))
    yield "least change of contraction by 0.5 bar more", least
    yield "the same, by the text of the method", least
    shape = table.cycles(0.0)[1].shape
    yield "readings of a load: pressures by repeats", float(shape[0] * shape[1])
    name = "contraction at 6 bar without load less the largest with one"
    yield name, tops[0] - max(tops[1:])
    yield "25 % of the length", 0.25 * 100.0
    muscle = as_published(SingleMuscle.mas10("maxwell_slip")).muscle
    strain = np.linspace(0.0, 0.3, 301)
    force = np.asarray(muscle.tension(4e5, strain))
    name = "largest change of force at 4 bar by 0.1 % more contraction"
    yield name, float(np.diff(force).max())
    limit = float(np.interp(0.0, -np.asarray(muscle.tension(6e5, strain)), strain))
    yield "contraction without force at 6 bar", 100.0 * limit
    crossings = np.count_nonzero(np.diff(np.sign(force - 9.81 * 2.55)))
    yield "lengths of equilibrium at 4 bar and 2.55 kg", float(crossings)


def polynomials() -> Values:
    """Equations (1) to (12) as printed on the paper's own tables, and Table 6 itself."""
    table = load_contraction_table()
    pairs = [
        (pressure / BAR, contraction.mean(axis=1) / MM)
        for pressure, contraction in (
            table.branch(load, b) for load in table.loads for b in curves.BRANCHES
        )
    ]
    forward, refit = (c.reshape(6, 4) for c in (curves.PUBLISHED_FORWARD, curves.fitted_forward()))
    for k, (printed, places, why) in enumerate(DETERMINATIONS):
        known = {"k": k + 1, "places": places, "published": printed, "why": why}
        for words, cubic in (("as printed", forward[k]), ("refitted", refit[k])):
            ours = determination(cubic, *pairs[k])[0]
            yield f"determination of Eq. ({{k}}) {words}", ours, known
    x, rows = curves.TABLE_6_CONTRACTION, curves.TABLE_6_PRESSURE.reshape(6, 7)
    inverse, full = (
        c.reshape(6, 4) for c in (curves.PUBLISHED_INVERSE, curves.table_6_cubics(corrected=False))
    )
    printed_or_not = ("as printed", inverse), ("refitted", full)
    for k, value in enumerate(REFITTED):
        known = {"k": k + 7, "figure": 11 + k // 2, "expected": value}
        for words, cubics in printed_or_not:
            ours = determination(cubics[k], x, rows[k])[1]
            yield f"RMS error of Eq. ({{k}}) {words} on Table 6", ours, known
    for k, printed in ((4, 0.9972), (5, 0.9996)):
        for words, cubics in printed_or_not:
            ours, known = determination(cubics[k], x, rows[k])[0], {"published": printed}
            yield f"determination of Eq. ({{k}}) {words} on Table 6", ours, known | {"k": k + 7}
    rest = 0.0
    for k, (pressure, contraction) in enumerate(pairs):
        order, (i, j) = np.argsort(contraction), divmod(k, 2)
        read = np.interp(x, contraction[order], pressure[order])
        for row, (found, entry) in enumerate(zip(read, rows[k], strict=True)):
            if (i, j, row) not in SUSPECT:
                rest = max(rest, abs(float(found - entry)))
                continue
            at = {"load": table.loads[i], "branch": ("inflation", "deflation")[j], "mm": x[row]}
            name = "Table 6, {load:g} kg, {branch}, {mm:g} mm"
            yield name, float(found), at | {"published": float(entry)}
    yield "Table 6, largest difference of the other 40", rest


KNEE_GROUPS: tuple[Group, ...] = (brace,)
ELBOW_GROUPS: tuple[Group, ...] = (bundles,)
JOINT_GROUPS: tuple[Group, ...] = (joint_geometry,)
MUSCLE_GROUPS: tuple[Group, ...] = (table_statistics, polynomials)
