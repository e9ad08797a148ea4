"""Net work of plants on closed cycles of pressure and position, drawn at random."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.board.format import table
from pam_envs import plants
from pam_envs.hysteresis.protocol import DRIVES, kind_of
from pam_envs.plants.core.passivity import Cycles, cycle_work

CORNERS = 5
SMALLEST = 0.01  # smallest size of a cycle, over the range of positions


@dataclass(frozen=True)
class Case:
    """A plant by its hysteresis, with the ranges that its muscles are moved over.

    ``muscles`` share the position, which is a contraction or length [m] or an angle [rad].
    """

    make: Callable[..., Any]
    muscles: int
    full_pressure: float
    low: float
    high: float

    def corners(self, cycles: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Draw pressures over the whole range and positions over a part of it."""
        random = np.random.default_rng(seed)
        size = (self.high - self.low) * SMALLEST ** random.uniform(0.0, 1.0, cycles)
        first = random.uniform(self.low, self.high - size)
        pressures = random.uniform(0.0, self.full_pressure, (self.muscles, CORNERS, cycles))
        return pressures, first + size * random.uniform(0.0, 1.0, (CORNERS, cycles))

    def work(self, kind: str, cycles: int, seed: int) -> Cycles:
        """Return the energies of drawn cycles with a kind of hysteresis."""
        return cycle_work(self.make(hysteresis=kind), self.corners(cycles, seed))


CASES = {
    "single muscle": Case(plants.SingleMuscle.mas10, 1, 6e5, 0.0, 0.014),
    "knee orthosis": Case(plants.KneeOrthosis.no_load, 1, 4.5e5, 0.19, 0.25),
    "antagonistic joint": Case(plants.AntagonisticJoint.paper, 2, 6.5e5, -0.45, 0.45),
    "redundant manipulator": Case(plants.RedundantManipulator.paper, 2, 6.5e5, -0.45, 0.45),
    "elbow orthosis": Case(plants.ElbowOrthosis.paper, 2, 4e5, 0.1, 2.0),
}


def net_work(cycles: int, seed: int) -> str:
    """Return a table of the largest net work over the stroke's work, for every plant and model."""
    kinds = [(choice, drive) for drive in DRIVES for choice in ("maxwell_slip", "preisach")]
    lines = [
        [name, *(f"{case.work(kind_of(*kind), cycles, seed).worst:+.4f}" for kind in kinds)]
        for name, case in CASES.items()
    ]
    return "\n".join(table(["plant", *(f"{c}, {d}" for c, d in kinds)], lines))


PRESSURES = np.array([1e5, 2e5, 3e5, 4e5, 5e5])


def isobaric_loops(plant: Any, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the forces, shape (pressures, T), of one muscle whose length goes up and down.

    At each of ``PRESSURES`` [Pa]; ``lengths`` (T,) are positions of :meth:`imposed_muscles`, and
    the loop is the second one.
    """
    muscles = plant.imposed_muscles(len(PRESSURES))
    state, forces = muscles.state, []
    for x in np.concatenate([lengths, lengths]):
        force, state = muscles.force(PRESSURES[None], np.full(len(PRESSURES), x), state)
        forces.append(force)
    return np.array(forces[len(lengths) :]).T


def isobaric_figure() -> Any:
    """Return force over contraction of the MAS-10 at constant pressures, large and small loops."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 4.2), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    kinds = ("maxwell_slip_length", "preisach_length", "maxwell_slip")
    titles = ("Maxwell-slip, driven by length", "Preisach, driven by length", "driven by pressure")
    for ax, kind, title in zip(panels, kinds, titles, strict=True):
        plant = plants.SingleMuscle.mas10(kind, mass__load=0.0)
        for low, high, width in ((0.0, 0.012, 1.4), (0.005, 0.007, 0.8)):
            up = np.linspace(low, high, 121)
            lengths = np.concatenate([up, up[::-1]])
            for k, force in enumerate(isobaric_loops(plant, lengths)):
                ax.plot(1e3 * lengths, force, color=f"C{k}", linewidth=width)
                if low == 0.0:
                    label = f"{1e-5 * PRESSURES[k]:g} bar"
                    ax.annotate(label, (0.1, force[0]), color=f"C{k}", fontsize=8, va="bottom")
        ax.set_title(title)
        ax.set_xlabel("contraction [mm]")
        ax.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("force [N]")
    panels[0].set_ylim(0.0, 530.0)
    figure.suptitle("MAS-10 at constant pressure: slow loops of 12 and 2 mm")
    return figure
