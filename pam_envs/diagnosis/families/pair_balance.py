"""Regression of the torque balance of joints between pairs of muscles: where fits of them start.

At slow motion the torques of both muscles balance weight and payload. The law of the muscles is
linear in its coefficients, and so is the friction for given limits of its elements. The target is
the torque of the pressures on the usual area, since most samples have no other known torque; the
payload gives the scale, and without one the area keeps its usual value. Errors of the torque are
weighed by the compliance, so that the regression minimises errors of the angle.

The flexible regression also has the terms of the law's correction and a difference of the muscles.
This difference multiplies the law: its derivative at the coefficients of one round is a term of the
next one.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from pam_envs.arrays import Array, Flags
from pam_envs.diagnosis.fit.balance import (
    MAP_PRIOR,
    REVERSAL,
    Limits,
    Regression,
    slipping,
    without_jitter,
)
from pam_envs.diagnosis.fit.single_muscle import map_of

SLOW = 0.15  # speed [rad/s] below which a sample is an equilibrium of torques
SETTLED = 0.06  # slow way [rad] after which the friction has forgotten a fast motion
WINDOW = 0.1  # [s] over which angles are averaged
FEWEST, MOST = 200, 4000  # least and largest number of samples
ROUNDS = 4
TAUT = 1.0  # least force [N] of a muscle that is not slack
CLEARLY = 8e4  # pressure [Pa] above which a muscle is taken for taut at first
LEAST_STIFF = 0.3  # least stiffness of a weight, over the median
BRAIDS = (0.01, 0.02, 0.04, 0.08)
"""Tried strains over which the resistance of the braid builds up."""
GROWTHS = (0.0, 1e-6, 3e-6, 1e-5, 1e-4)
"""Tried growths of the friction with pressure [1/Pa]."""
USUAL_WEIGHTS = 0.8
"""Sum of the weights of the friction's elements."""
SCALES, WEIGHTS = (0.7, 1.4), (0.5, 2.0)
"""Bounds of the usual area over that of the muscles, and of the own weight over the usual one."""
LAW = ("area", "taper", "threshold", "braid_force", "stiffness")
FLEXIBLE_ROUNDS = 8
MOST_UNEQUAL = 0.3
"""Largest difference of the muscles, over their mean."""


class Course(NamedTuple):
    """Values in which the forces are not linear."""

    braid: float  # strain over which the resistance of the braid builds up
    growth: float  # of the friction with pressure [1/Pa]


class Solved(NamedTuple):
    """Solution of a regression."""

    error: float  # squared, over the noise
    course: Course
    coefficients: Array  # of law, friction, and correction
    weight: float  # factor on the plant's own weight
    imbalance: float


@dataclass(frozen=True)
class PairBalance:
    """Readings of joints and their muscles, and a plant with a law of pairs.

    Attributes
    ----------
    plant : PairPlant
    reference : float
        Pressure [Pa] at which the friction has its usual limits.
    angle, noise : ndarray, shape (n, T) and float
        Of the joints [rad], NaN where there is no reading.
    pressure : ndarray, shape (2 n, T)
        Of the muscles [Pa].
    weight, carried : ndarray, shape (n, T)
        Torque [N m] of the plant's own weight and of the payload, which oppose the muscles.
    period : float
        Sampling period [s].
    orders : tuple of tuple of int
        Orders in pressure and strain of the terms of the law's correction; without any, there is
        no flexible regression.
    """

    plant: Any
    reference: float
    angle: Array
    noise: float
    pressure: Array
    weight: Array
    carried: Array
    period: float
    orders: tuple[tuple[int, int], ...] = ()

    @cached_property
    def _smooth(self) -> Array:
        """Angles (n, T) without noise, complete."""
        window, made = max(3, round(WINDOW / self.period)), []
        for angle in self.angle:
            seen = np.flatnonzero(np.isfinite(angle))
            known = np.interp(np.arange(len(angle)), seen, angle[seen])
            made.append(without_jitter(uniform_filter1d(known, window), REVERSAL * self.noise))
        return np.array(made)

    @cached_property
    def _balanced(self) -> Flags:
        """Samples (n, T) of each joint that moved slowly for some way, while all joints are slow.

        A fast motion may overshoot, and leaves the friction in a state that the readings hide; that
        of another joint only shakes this one.
        """
        window = max(3, round(2.0 * WINDOW / self.period))
        speed = np.abs(np.gradient(self._smooth, self.period, axis=1))
        slow = uniform_filter1d(speed, window, axis=1) < SLOW
        way = np.cumsum(speed, axis=1) * self.period
        since = np.maximum.accumulate(np.where(slow, 0.0, way), axis=1)
        return (way - since > SETTLED) & slow.all(axis=0) & np.isfinite(self.angle)

    @cached_property
    def _slow(self) -> Flags:
        """Samples (T,) of the regression: at most :data:`MOST` at which a joint is in balance."""
        rows = np.flatnonzero(self._balanced.any(axis=0))
        kept = np.zeros(self.angle.shape[1], bool)
        kept[rows[:: max(1, len(rows) // MOST)]] = True
        return kept

    @cached_property
    def _geometry(self) -> tuple[Array, Array, Array]:
        """Strain, ``dL/dphi`` [m] and its derivative [m] of the muscles, (2 n, T)."""
        lever, length = self.plant.lever, self.plant.muscle.rest_length
        step = 1e-4
        strain = lever.contraction(self._smooth, length)
        rate = lever.rate(self._smooth)
        curve = (lever.rate(self._smooth + step) - lever.rate(self._smooth - step)) / (2.0 * step)
        joints, samples = self._smooth.shape
        shape = (2 * joints, samples)
        return (
            strain.transpose(0, 2, 1).reshape(shape),
            rate.transpose(0, 2, 1).reshape(shape),
            curve.transpose(0, 2, 1).reshape(shape),
        )

    def _law(self, braid: float) -> Array:
        """Return the forces by coefficient of the law, (5, 2 n, T)."""
        strain, p = self._geometry[0], self.pressure
        e = strain / self.plant.muscle.stretch
        return np.array([p, -p * e, -np.ones_like(p), np.expm1(-e / braid), -e])

    def _friction(self, growth: float) -> Array:
        """Return the forces by element of the friction, (elements, 2 n, T)."""
        thresholds = self.plant.hysteresis.operator.thresholds
        limit = (1.0 + growth * self.pressure) / (1.0 + growth * self.reference)
        made = np.zeros((len(thresholds), *self.pressure.shape))
        for k, threshold in enumerate(thresholds):
            for m, path in enumerate(self._geometry[0]):
                slipping(np.ascontiguousarray(path), threshold * limit[m], made[k, m])
        return -made

    def _correction(self) -> Array:
        """Return the forces by term of the law's correction, (terms, 2 n, T)."""
        strain, law = self._geometry[0], self.plant.muscle
        flat = self.pressure.ravel(), strain.ravel() - law.map_least
        return map_of(law, *flat, self.orders)[0].reshape(len(self.orders), *strain.shape)

    def solve(self) -> dict[str, float]:
        """Return parameters of law and friction; empty if slow samples are too few.

        ``weight`` is the factor on the plant's own weight.
        """
        return self._named(flexible=False)

    def flexible(self) -> dict[str, float]:
        """Return parameters of law, correction, difference and friction, likewise."""
        return self._named(flexible=True) if self.orders else {}

    def _solved(self, course: Course, flexible: bool) -> Solved:
        """Return the solution with a course of the forces."""
        rows, law = self._slow, self._law(course.braid)
        friction = self._friction(course.growth)
        parts = [law, friction, *([self._correction()] if flexible else [])]
        forces = np.concatenate(parts)[:, :, rows]
        gained = np.ones(len(forces), bool)  # forces that a difference multiplies
        gained[len(law) : len(law) + len(friction)] = False
        strain, rate, curve = (values[:, rows] for values in self._geometry)
        pressure = self.pressure[:, rows]
        taut = pressure > CLEARLY
        joints = len(self.angle)
        side = np.tile([1.0, -1.0], joints)[:, None]
        weight, carried = self.weight[:, rows], self.carried[:, rows]
        balanced = self._balanced[:, rows]
        number = len(forces) + flexible
        limits, usual = self._limits(number + 1, flexible), self.plant.muscle.area
        stiff = np.full(weight.shape, 1.0)
        error, c, imbalance, own = np.inf, np.zeros(len(forces)), 0.0, 1.0
        for k in range(FLEXIBLE_ROUNDS if flexible else ROUNDS):
            gains = np.where(gained[:, None, None], 1.0 + imbalance * side, 1.0)
            acting = forces * gains
            if flexible:  # derivative by the difference, at the last coefficients
                more = side * np.tensordot(c * gained, forces, 1)
                acting = np.concatenate([acting, more[None]])
            by_muscle = -acting * rate * taut
            torque = by_muscle.reshape(number, joints, 2, -1).sum(axis=2)
            opposed = np.stack([weight, carried])
            columns = np.concatenate([-torque[1:], opposed]).reshape(number + 1, -1)
            kept = balanced & taut.reshape(joints, 2, -1).all(axis=1) if k == 0 else balanced
            floor = LEAST_STIFF * float(np.median(stiff))
            weights = (kept / (np.maximum(stiff, floor) * self.noise)).ravel()
            regression = Regression(columns, usual * torque[0].ravel(), weights, limits)
            places = np.arange(len(columns))
            if flexible and k == 0:
                places = np.delete(places, number - 2)  # no coefficients yet
            found = regression.solve(places)
            scale = 1.0 / found.coefficients[-1] if carried.any() else 1.0
            c = scale * np.append(usual, found.coefficients[: len(forces) - 1])
            own = scale * float(found.coefficients[-2])
            if flexible and k > 0:
                step = scale * float(found.coefficients[number - 2])
                imbalance = float(np.clip(imbalance + step, -MOST_UNEQUAL, MOST_UNEQUAL))
            error = found.error / kept.mean()
            gains = np.where(gained[:, None, None], 1.0 + imbalance * side, 1.0)
            force = np.einsum("i,imt->mt", c, forces * gains)
            taut = force > TAUT
            e = strain / self.plant.muscle.stretch
            steep = c[1] * pressure + c[3] / course.braid * np.exp(-e / course.braid) + c[4]
            steep = steep * rate**2 / self.plant.muscle.rest_length * taut
            turned = (steep + force * curve * taut).reshape(joints, 2, -1).sum(axis=1)
            stiff = np.maximum(turned + np.abs(weight), 1e-3)
        return Solved(error, course, c, own, imbalance)

    def _limits(self, columns: int, flexible: bool) -> Limits:
        """Return the limits of the coefficients."""
        limits = Limits(
            low=np.zeros(columns),
            high=np.full(columns, np.inf),
            centre=np.zeros(columns),
            precision=np.zeros(columns),
        )
        limits.low[-1], limits.high[-1] = SCALES
        limits.low[-2], limits.high[-2] = WEIGHTS
        if flexible:
            first = columns - 3 - len(self.orders)
            terms = slice(first, first + len(self.orders))
            limits.low[terms], limits.precision[terms] = -np.inf, MAP_PRIOR**-2
            limits.low[-3] = -np.inf
        return limits

    def _named(self, flexible: bool) -> dict[str, float]:
        """Return the coefficients of the best course by parameter."""
        if self._slow.sum() < FEWEST:
            return {}
        courses = (Course(*pair) for pair in product(BRAIDS, GROWTHS))
        solved = min((self._solved(course, flexible) for course in courses), key=_error)
        c, (braid, growth) = solved.coefficients, solved.course
        area = max(float(c[0]), 1e-6)
        found = {f"muscle.{name}": float(v) for name, v in zip(LAW, c, strict=False)}
        found |= {"muscle.taper": found["muscle.taper"] / area, "muscle.braid_strain": braid}
        n = len(self.plant.hysteresis.operator.thresholds)
        sizes = c[len(LAW) : len(LAW) + n]
        stiffness = max(float(sizes.sum()) / USUAL_WEIGHTS, 1.0)
        base = stiffness / (1.0 + growth * self.reference)
        found |= {"hysteresis.base": base, "hysteresis.rate": base * growth}
        found |= {f"hysteresis.weight[{k}]": float(v) / stiffness for k, v in enumerate(sizes)}
        if flexible:
            names = [f"muscle.map_{p}{e}" for p, e in self.orders]
            found |= dict(zip(names, map(float, c[len(LAW) + n :]), strict=True))
            found["muscle.imbalance"] = found["muscle.friction_imbalance"] = solved.imbalance
        return found | {"weight": solved.weight}


def _error(solved: Solved) -> float:
    return solved.error
