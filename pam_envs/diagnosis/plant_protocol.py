"""Protocol of a plant that can be diagnosed.

A :class:`Kind` is a plant before a recording is given: its channels, its causes, and its
requirements on a recording. :meth:`Kind.bind` gives a :class:`Bound` plant with the inputs of a
recording, which replays parameter columns. Search, decision, held-out comparison, report and
figures use these two alone.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from pam_envs.arrays import Array, Flags
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import Audit
from pam_envs.diagnosis.cause import Cause, Form
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate
from pam_envs.diagnosis.fit.least_squares import Free, PlantFamily, Problem


@dataclass(frozen=True)
class Output:
    """Output of a plant.

    Attributes
    ----------
    name : str
        Name of the channel in a recording.
    noise : float
        RMS of its sensor's noise [SI] where a recording shows none.
    """

    name: str
    noise: float


@dataclass(frozen=True)
class Signals:
    """Signals of a simulation that may explain a residual.

    Attributes
    ----------
    drive : str
        Name of the driving signal, in reports.
    command : ndarray, shape (T,)
        Its setpoint; of the size of a pressure [Pa].
    outputs : ndarray, shape (2, T)
        The motion, and the driving signal, of the size of a pressure [Pa].
    load : ndarray, shape (T,)
        Load, of the size of a force [N].
    temperature : ndarray or None, shape (T,)
        [deg C].
    label : str
        Name and unit of the driving signal in figures, of a plant whose outputs do not hold it.
    scale : float
        Size [SI] of that unit in the driving signal.
    """

    drive: str
    command: Array
    outputs: Array
    load: Array
    temperature: Array | None = None
    label: str = ""
    scale: float = 1.0

    @property
    def shown(self) -> tuple[str, Array] | None:
        """Label and values of the driving signal for figures."""
        return (self.label, self.outputs[1] / self.scale) if self.label else None


@dataclass(frozen=True)
class Loop:
    """Closed loop in which controllers of a family are compared.

    Attributes
    ----------
    env : str
        Id of an environment of the family.
    controller : str
        Name of the paper's controller in the catalogue.
    unit, scale : str and float
        Unit of the tracking error in reports, and its size [SI].
    reference : str, optional
        Argument of the environment; None: its default.
    """

    env: str
    controller: str
    unit: str
    scale: float
    reference: str | None = None


class Simulated(Protocol):
    """A plant with given inputs."""

    def simulate(self, columns: Array) -> Array:
        """Return sensor readings for parameter columns (n, p), shape (channels, T, n)."""


@dataclass(frozen=True)
class Experiment:
    """Experiment that a rig can do.

    Attributes
    ----------
    name : str
    description : str
        Instruction in words.
    segments : sequence of mapping
        Instructions piece by piece, for the report.
    bound : Simulated
        The fitted plant with the inputs of the experiment.
    """

    name: str
    description: str
    segments: Sequence[Mapping[str, Any]]
    bound: Simulated


class Parameter(Protocol):
    """Declaration of a parameter (:class:`pam_envs.parameters.Declaration`)."""

    @property
    def unit(self) -> str:
        """Unit in SI."""

    @property
    def neutral(self) -> float | None:
        """Value without effect, if there is one."""


class Bound(PlantFamily, Protocol):
    """A plant with the inputs of a recording."""

    @property
    def plant(self) -> Any:
        """The plant whose parameters are the column."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the outputs, in the order of a simulation."""

    @property
    def checks(self) -> int:
        """Number of checks of :meth:`violations`."""

    def tie(self, columns: Array) -> None:
        """Complete parameter columns (n, p) in place."""

    def violations(self, columns: Array) -> Array:
        """Return by how much columns are not physical, over a tolerance, shape (n, checks)."""

    def base(self) -> tuple[Free, ...]:
        """Return the parameters that every fit adapts."""

    def declared(self, name: str) -> Parameter:
        """Return the declaration of a free parameter."""

    def unmet_needs(self, recording: Recording, sheet: Rig) -> dict[str, str]:
        """Return the needs of causes that a recording does not meet, and why."""

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return the signals of simulated outputs (channels, T) that may explain a residual."""

    def plant_of(self, column: Array) -> Any:
        """Return the plant with the parameters of a column."""

    def identified(self, plant: Any, frees: Iterable[Free], source: str) -> Any:
        """Return a plant with the provenance of its fitted parameters."""


class Fitted(Protocol):
    """Base of a plant, fitted to a recording."""

    @property
    def family(self) -> Bound:
        """The plant, in the variant that the recording needs."""

    @property
    def problem(self) -> Problem:
        """Readings and simulation of the fits."""

    @property
    def base(self) -> Candidate:
        """The fitted base."""

    @property
    def guesses(self) -> Sequence[Mapping[str, float]]:
        """Starting values by parameter, of the base and its common differences."""

    @property
    def shown(self) -> Mapping[str, Form]:
        """Effects of the valve that the pressure clearly shows, by cause."""

    @property
    def linear(self) -> bool:
        """Whether a linear model may show that a difference is needed, without a refit."""

    @property
    def begins(self) -> Sequence[str]:
        """Parameters of the start of the recording, which are fitted beside the differences."""

    @property
    def others(self) -> Callable[[], Sequence[Mapping[str, float]]]:
        """Gives the starting values by parameter with friction of one kind alone."""


class Kind(Protocol):
    """A plant that can be diagnosed, before a recording is given."""

    @property
    def name(self) -> str:
        """Name of the family."""

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Outputs that a recording may hold; one is enough."""

    @property
    def catalogue(self) -> tuple[Cause, ...]:
        """Causes that are asked for by default."""

    @property
    def weighed(self) -> bool:
        """Whether the error of declared loads is a parameter of the plant."""

    @property
    def loop(self) -> Loop | None:
        """Closed loop of the family; None: that of a single muscle."""

    @property
    def loop_reason(self) -> str:
        """Reason why controllers cannot be compared; empty if they can."""

    def start(self, sheet: Rig) -> Any:
        """Return the default plant of a rig."""

    def causes(self, asked: Sequence[Cause]) -> tuple[Cause, ...]:
        """Return the requested causes that the plant can have, in its own parameters."""

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> Bound:
        """Return a plant with the inputs of a recording."""

    def plans(self, recording: Recording, sheet: Rig, family: Bound) -> Sequence[Experiment]:
        """Return the experiments that the rig of a recording can do, on the fitted plant."""

    def audit(self, recording: Recording, sheet: Rig) -> Audit:
        """Return the findings on a recording before its diagnosis."""

    def compared(self, measured: Array, family: Bound, restart: Flags) -> Array:
        """Return readings (channels, T), NaN where they are not compared with a simulation.

        ``restart`` marks the first sample of each run, (T,).
        """

    def calibrate(
        self,
        family: Bound,
        measured: Array,
        noise: Array,
        blocks: Blocks,
        time: Array,
        shapes: Array,
    ) -> Fitted:
        """Fit the base to readings (channels, T) with a noise (channels,)."""
