"""Equations, tables and statements of the papers that are checked by themselves, without a run."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from baselines.positioning import contraction_tables as curves
from benchmarks.papers.elbow import SOURCE as ELBOW
from benchmarks.papers.elbow import bundle
from benchmarks.papers.joint import SOURCE as JOINT
from benchmarks.papers.knee import SOURCE as KNEE
from benchmarks.papers.published import BEFORE, Figure, Group, as_published
from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.tables import load_contraction_table
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.single_muscle.plant import SingleMuscle

# --- knee orthosis ------------------------------------------------------------------------------

NOMINAL = np.radians(110.0)
"""Angle [rad] of the assumed brace at the paper's nominal length of 22 cm."""


def brace() -> Iterator[Figure]:
    """Balance of torques, length and tension of the brace, law of the braid."""
    plant = as_published(KneeOrthosis.rig("maxwell_slip"))
    lever, h = plant.lever, 1e-6
    slope = float(lever.length(NOMINAL + h) - lever.length(NOMINAL - h)) / (2.0 * h)
    arm = slope / (lever.arm * np.cos(0.5 * NOMINAL))
    words, where = "T L_b cos(theta / 2)", f"{KNEE}, Eq. (3); Eq. (4)"
    name = "dL/dtheta over L_b cos(theta / 2)"
    yield Figure(name, arm, "", where, expected=1.0, tolerance=1e-6, note="by virtual work")
    cosine = np.cos(0.5 * NOMINAL)
    name, where = "lever arm of Eq. (3) over that of cos2", f"{KNEE}, section 4.1: desired tension"
    why = "cos2 is a misprint: Eq. (3) and virtual work have cos"
    yield Figure(name, 1.0 / cosine, "", where, expected=1.0, tolerance=1e-6, claim=words, why=why)
    printed = lever.stiffness * (NOMINAL - lever.relaxed_angle) / (lever.arm * cosine)
    name = "tension without assistance as printed"
    where = f"{KNEE}, section 3: tension for a torque"
    why = "a sign: the wire is bent below its relaxed angle, kappa (theta_0 - theta) is meant"
    yield Figure(name, printed, "N", where, at_least=0.0, claim="shortening tension", why=why)
    name, where = "tension without assistance at 22 cm", f"{KNEE}, section 4.1: operating point"
    note = "calibrated: spring of the assumed brace"
    yield Figure(name, float(lever.tension(0.0, NOMINAL)), "N", where, 158.0, 0.5, note, given=True)
    stiffness = plant.muscle.stiffness_ratio * np.array([1e5, 2e5])
    tension = plant.muscle.tension(stiffness, plant.fixture.length)
    name, where = "tension at 2 bar and 22 cm", f"{KNEE}, section 4.1: operating point"
    yield Figure(name, float(tension[1]), "N", where, 158.0, 0.5, "an input (alpha)", given=True)
    name, where = "tension at 2 bar over that at 1 bar", f"{KNEE}, Eq. (6)"
    ratio = float(tension[1] / tension[0])
    yield Figure(name, ratio, "", where, expected=2.0, tolerance=1e-9, note="T / dL = alpha P")
    thread, turns, length = 0.25, 1.5, 0.2

    def volume(at: float) -> float:
        return (thread**2 - at**2) * at / (4.0 * np.pi * turns**2)

    work = -(volume(length + h) - volume(length - h)) / (2.0 * h)
    law = np.pi * thread**2 / (4.0 * np.pi * turns**2) * (3.0 * length**2 / thread**2 - 1.0)
    name, where = "force of Eq. (5) over that of virtual work", f"{KNEE}, Eq. (5)"
    why = "one pi too many; b is the length of a thread, not an angle"
    yield Figure(name, law / work, "", where, expected=1.0, tolerance=1e-6, why=why)


# --- elbow orthosis -----------------------------------------------------------------------------

AT_REST = {1: 14.0, 7: 111.0}
"""Muscles: force [N] at nominal length and zero pressure."""
ONE_END = "the law has one largest contraction, 28 %, up to which filling raises the force"


def bundles() -> Iterator[Figure]:
    """Force and stiffness of bundles: Eqs. (4), (5) and (7), and statements on them."""
    three, p = bundle(3), 4e5
    c = np.linspace(0.0, 0.9 * three.reach, 50)
    length, least = three.nominal_length - c, three.nominal_length - three.reach
    simple = three.pressure_factor * p * length * (length - least)
    off = float(np.abs((three.law(p, c) - three.law(0.0, c)) / simple - 1.0).max())
    words, where = "is transformed", f"{ELBOW}, Eq. (4); Eq. (5)"
    name = "Eq. (5) without k0 over Eq. (4), less 1"
    yield Figure(name, off, "", where, at_most=1e-9, claim=words)
    h = 1e-6
    slope = (three.law(p, c + h) - three.law(p, c - h)) / (2.0 * h)
    worst = float(np.abs(slope / three.stiffness(p, c) - 1.0).max())
    name, where = "Eq. (7) over a finite difference, less 1", f"{ELBOW}, Eq. (7)"
    yield Figure(name, worst, "", where, at_most=1e-6, claim="k = dP/dC")
    bends = [
        np.diff(three.stiffness(p, c), 2),
        np.diff(three.stiffness(np.linspace(0.0, 6e5, 9), 0.05), 2),
        np.diff([float(bundle(n).stiffness(p, 0.05)) for n in range(1, 8)], 2),
    ]
    bend = max(float(np.abs(b).max()) for b in bends) / float(np.abs(three.stiffness(p, 0.0)))
    name, where = "second difference of the stiffness", f"{ELBOW}, section 2: linear stiffness"
    note = "in contraction, pressure and number, each alone; it is not linear in them together"
    yield Figure(name, bend, "", where, note=note, at_most=1e-9, claim="a linear function")
    stiff = np.diff([-float(bundle(n).stiffness(p, 0.0)) for n in range(1, 7)])
    name, where = "least gain of stiffness by a muscle", f"{ELBOW}, section 2: stiffness and number"
    yield Figure(name, float(stiff.min()), "N/m", where, at_least=0.0, claim="an increase")
    where = f"{ELBOW}, section 2: elastic at zero pressure; Fig. 4"
    for n, value in AT_REST.items():
        ours = float(bundle(n, 0.33).law(0.0, 0.0))
        name = f"force of {n} at 0 kPa and nominal length"
        yield Figure(name, ours, "N", where, note=BEFORE, expected=value, tolerance=0.5)
    for share, place in ((24, "24 %"), (32, "28 and 32 %")):
        at = 0.01 * share * bundle(1).nominal_length
        ours = float(bundle(1).law(5e5, at) - bundle(1).law(0.0, at))
        name = f"gain of force by filling at {share} %"
        where = f"{ELBOW}, section 2: filling at {place}"
        words = "does not exceed its original size" if share == 24 else "a decrease"
        yield Figure(name, ours, "N", where, at_most=0.0, claim=words, why=ONE_END)


# --- antagonistic joint -------------------------------------------------------------------------


def joint_geometry() -> Iterator[Figure]:
    """Lengths of the muscles over the angle, and the inverse of the static map."""
    plant = as_published(AntagonisticJoint.paper("maxwell_slip"))
    ends = np.sort(1e3 * (plant.lever.length(np.radians(30.0)) + plant.lever.fittings))
    where = f"{JOINT}, Eq. (1.1)"
    for name, ours, value in zip(("shortest", "longest"), ends, (174.4, 211.9), strict=True):
        title = f"{name} distance of the ends of a muscle at 30 degrees"
        note = f"{BEFORE}; plates of 36.2 and 100 mm"
        yield Figure(title, float(ours), "mm", where, note=note, expected=value, tolerance=0.05)
    rest = plant.muscle.rest_length
    share = 100.0 * float(np.max(plant.lever.contraction(np.radians(30.0), rest)))
    where = f"{JOINT}, section 2: range of the joint; section 1.1: largest contraction"
    note = "an input: the plates are chosen for it"
    title = "contraction at 30 degrees"
    yield Figure(title, share, "%", where, 25.0, 0.05, note, given=True)
    angle = np.radians(np.linspace(-25.0, 25.0, 51))
    a, b, missed = plant.pressures_for(angle)
    torque = float(np.abs(plant.torque(angle, a, b)[~missed]).max())
    title, where = "torque left by the inverse map", f"{JOINT}, Fig. 4"
    words = "compensates the static nonlinear relations"
    yield Figure(title, torque, "N m", where, at_most=1e-6, claim=words)


# --- single muscle ------------------------------------------------------------------------------

MUSCLE = "positioning2021"
LOADS = {0.0: "Table 3", 2.55: "Table 4", 4.55: "Table 5"}
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
CUT = "coefficients cut after three decimals, too few for a cube"
SUSPECT = {(2, 0, 0), (0, 1, 0)}
"""Load, branch and row of the entries of Table 6 that are not on the curves of Tables 3 to 5."""
SCATTER = 0.15
"""Difference [bar] of an entry by the scatter of the readings, 0.3 mm at 2 to 3 mm/bar."""
WRONG = "the entry is not on the measured curve, and Eqs. (7) to (12) were fitted to it"


def numbers(text: str) -> Array:
    """Return the numbers of a printed column."""
    return np.array([float(word) for word in text.split()])


def determination(cubic: Array, x: Array, y: Array) -> tuple[float, float]:
    """Return the coefficient of determination and the RMS error of a cubic on pairs."""
    error = np.polyval(cubic, x) - y
    spread = np.sum((y - y.mean()) ** 2)
    return float(1.0 - np.sum(error**2) / spread), float(np.sqrt(np.mean(error**2)))


def table_statistics() -> Iterator[Figure]:
    """Means and standard deviations of Tables 3 to 5, and statements on the readings."""
    table = load_contraction_table()
    steps, tops = list[float](), list[float]()
    for load, place in LOADS.items():
        readings = table.cycles(load)[1] / MM
        off = float(np.abs(readings.mean(axis=1) - numbers(PRINTED_MEANS[load])).max())
        name, words = f"{load:g} kg: largest difference of a printed mean", "Arithmetic Mean"
        where = f"{MUSCLE}, {place}"
        yield Figure(name, off, "mm", where, at_most=0.0061, claim=words)
        off = float(np.abs(readings.std(axis=1) - numbers(PRINTED_DEVIATIONS[load])).max())
        name = f"{load:g} kg: largest difference of a printed deviation"
        words = "Standard Deviation"
        where += "; section 3.1.1: standard deviations" if load == 0.0 else ""
        note = "of a population: divided by 5, not by 4"
        yield Figure(name, off, "mm", where, at_most=1.1e-5, claim=words, note=note)
        inflated = table.branch(load, True)[1].mean(axis=1) / MM
        steps, tops = [*steps, *np.diff(inflated)], [*tops, float(inflated[-1])]
    least = float(min(steps))
    name = "least change of contraction by 0.5 bar more"
    where = f"{MUSCLE}, section 2.2: rule 2; Fig. 3"
    yield Figure(name, least, "mm", where, at_least=0.0, claim="will decrease")
    name, where = "the same, by the text of the method", "section 2.3: contraction and pressure"
    why = "the text has the sign of the length; the tables and Fig. 4 have that of the contraction"
    where, words = f"{MUSCLE}, {where}", "decreases while the applied pressure is raised"
    yield Figure(name, least, "mm", where, at_most=0.0, claim=words, why=why)
    shape = table.cycles(0.0)[1].shape
    name, where = "readings of a load: pressures by repeats", f"{MUSCLE}, section 2.3: steps"
    note = "25 pressures, five cycles"
    yield Figure(
        name, float(shape[0] * shape[1]), "1", where, expected=125.0, tolerance=0.0, note=note
    )
    name = "contraction at 6 bar without load less the largest with one"
    where = "section 4: largest"
    words, where = "when the muscle is not loaded", f"{MUSCLE}, {where} contraction"
    yield Figure(name, tops[0] - max(tops[1:]), "mm", where, at_least=0.0, claim=words)
    name, where = "25 % of the length", f"{MUSCLE}, section 2.2: 25 %; Table 1"
    why = "the text has 25 % of 100 mm, Table 1 at most 20 mm"
    yield Figure(name, 0.25 * 100.0, "mm", where, 20.0, 0.5, why=why)
    muscle = as_published(SingleMuscle.mas10("maxwell_slip")).muscle
    strain = np.linspace(0.0, 0.3, 301)
    force = np.asarray(muscle.tension(4e5, strain))
    name = "largest change of force at 4 bar by 0.1 % more contraction"
    where = f"{MUSCLE}, Fig. 3; section 2.2: rule 3"
    words = "will shorten if its load is reduced"
    yield Figure(name, float(np.diff(force).max()), "N", where, at_most=0.0, claim=words)
    limit = float(np.interp(0.0, -np.asarray(muscle.tension(6e5, strain)), strain))
    name, where = "contraction without force at 6 bar", f"{MUSCLE}, section 2.2: rule 4"
    note = "law of the plant on the measured range, extrapolated"
    words = "an upper limit"
    yield Figure(name, 100.0 * limit, "%", where, at_most=25.0, claim=words, note=note)
    crossings = np.count_nonzero(np.diff(np.sign(force - 9.81 * 2.55)))
    name, where = "lengths of equilibrium at 4 bar and 2.55 kg", f"{MUSCLE}, section 2.2: rule 5"
    yield Figure(name, float(crossings), "1", where, 1.0, 0.0)


def polynomials() -> Iterator[Figure]:
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
        where = f"{MUSCLE}, Eq. ({k + 1}); {places}"
        for words, cubic in (("as printed", forward[k]), ("refitted", refit[k])):
            name = f"determination of Eq. ({k + 1}) {words}"
            ours = determination(cubic, *pairs[k])[0]
            yield Figure(name, ours, "1", where, printed, 1e-3, why=why)
    x, rows = curves.TABLE_6_CONTRACTION, curves.TABLE_6_PRESSURE.reshape(6, 7)
    inverse, full = (
        c.reshape(6, 4) for c in (curves.PUBLISHED_INVERSE, curves.table_6_cubics(corrected=False))
    )
    for k, value in enumerate(REFITTED):
        where = f"{MUSCLE}, Eq. ({k + 7}); Fig. {11 + k // 2}"
        for words, cubic in (("as printed", inverse[k]), ("refitted", full[k])):
            name = f"RMS error of Eq. ({k + 7}) {words} on Table 6"
            ours = determination(cubic, x, rows[k])[1]
            more: dict[str, Any] = {"note": BEFORE, "expected": value, "why": CUT}
            yield Figure(name, ours, "bar", where, tolerance=6e-4, **more)
    for k, printed in ((4, 0.9972), (5, 0.9996)):
        where = f"{MUSCLE}, section 3.2: R2; Eq. ({k + 7})"
        for words, cubic in (("as printed", inverse[k]), ("refitted", full[k])):
            name = f"determination of Eq. ({k + 7}) {words} on Table 6"
            ours = determination(cubic, x, rows[k])[0]
            yield Figure(name, ours, "1", where, printed, 1e-4, why=CUT)
    rest, where = 0.0, f"{MUSCLE}, Table 6"
    for k, (pressure, contraction) in enumerate(pairs):
        order, (i, j) = np.argsort(contraction), divmod(k, 2)
        read = np.interp(x, contraction[order], pressure[order])
        for row, (found, entry) in enumerate(zip(read, rows[k], strict=True)):
            if (i, j, row) not in SUSPECT:
                rest = max(rest, abs(float(found - entry)))
                continue
            branch = ("inflation", "deflation")[j]
            name = f"Table 6, {table.loads[i]:g} kg, {branch}, {x[row]:g} mm"
            yield Figure(name, float(found), "bar", where, float(entry), SCATTER, why=WRONG)
    name, words = "Table 6, largest difference of the other 40", "based on the measured values"
    yield Figure(name, rest, "bar", where, at_most=SCATTER, claim=words)


KNEE_GROUPS: tuple[Group, ...] = (brace,)
ELBOW_GROUPS: tuple[Group, ...] = (bundles,)
JOINT_GROUPS: tuple[Group, ...] = (joint_geometry,)
MUSCLE_GROUPS: tuple[Group, ...] = (table_statistics, polynomials)
