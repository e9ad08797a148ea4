"""List of experiments of a rig whose joints have one muscle or pairs of muscles.

The pieces are those of a single muscle. Pairs take them as equal pressures, and as the difference
of their pressures about a mean. Each pressure stays between the smallest and the largest command of
the recording, the difference within the recorded one, and the payloads are recorded ones.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR
from pam_envs.diagnosis.experiment.plans import (
    REST,
    TRIANGLE,
    Piece,
    listed_pieces,
    near,
)
from pam_envs.wording import enumeration

LOW, USUAL, HIGH = 0.35, 0.5, 0.65
"""Mean pressures of a pair of muscles, over the range of its pressures."""
FILLING = "full_pressure"
ALONE = ("slow_triangle", "three_step_sizes", "frequencies")
"""Experiments in which each joint of several also moves alone."""

Setpoints = Mapping[str, float]


@dataclass(frozen=True)
class Stage:
    """Setpoints [Pa] by channel at the shares 0 and 1 of the pieces, and payload [kg] if known."""

    low: Setpoints
    high: Setpoints
    payload: float | None = None

    def at(self, channel: str, share: Any) -> Any:
        """Return the setpoint of a channel [Pa]."""
        return self.low[channel] + share * (self.high[channel] - self.low[channel])


@dataclass(frozen=True)
class ChannelPlan:
    """An experiment with setpoints of several channels."""

    name: str
    description: str
    pieces: tuple[Piece, ...]  # repeated for each stage
    stages: tuple[Stage, ...]

    @property
    def inputs(self) -> dict[str, Array]:
        """Setpoints [Pa], and payload [kg] if known, each of shape (n,)."""
        share = np.concatenate([replace(p, shut=False).command for p in self.pieces])
        made = {
            name: np.concatenate([stage.at(name, share) for stage in self.stages])
            for name in self.stages[0].low
        }
        if self.stages[0].payload is not None:
            made["payload"] = np.repeat([float(s.payload or 0.0) for s in self.stages], len(share))
        return made

    @property
    def labels(self) -> tuple[list[str], tuple[str, ...]]:
        """Label of the piece of each sample, and the labels of those with closed valves."""
        pieces = [(f"piece_{k}", p) for k, p in enumerate(self.pieces * len(self.stages))]
        each = [label for label, p in pieces for _ in range(p.samples)]
        return each, tuple(label for label, p in pieces if p.shut)

    @property
    def segments(self) -> list[dict[str, Any]]:
        """Instructions piece by piece, for the report."""

        def bars(stage: Stage, share: float) -> dict[str, float]:
            return {name: round(stage.at(name, share) / BAR, 4) for name in stage.low}

        return [
            {
                "seconds": piece.seconds,
                "from_bar": bars(stage, piece.start),
                "to_bar": bars(stage, piece.end),
                **({"swing_hz": piece.hertz} if piece.hertz else {}),
                **({} if stage.payload is None else {"payload_kg": stage.payload}),
                "valve": "closed" if piece.shut else "open",
            }
            for stage in self.stages
            for piece in self.pieces
        ]


@dataclass(frozen=True)
class ChannelMeans:
    """Capabilities of a rig with several channels."""

    joints: Sequence[Mapping[str, Array]]  # recorded setpoints [Pa] of each joint's muscles
    payloads: Sequence[float] = ()  # [kg], ascending; empty without this input
    shut: bool = False  # the valves can be closed

    @property
    def payload(self) -> float | None:
        """The usual payload [kg]."""
        return near(self.payloads, 0.5) if self.payloads else None

    def equal(self) -> Stage:
        """Return equal pressures in all muscles of each joint."""
        low: dict[str, float] = {}
        high: dict[str, float] = {}
        for joint in self.joints:
            least, most = span(joint)
            low |= dict.fromkeys(joint, least)
            high |= dict.fromkeys(joint, most)
        return Stage(low, high, self.payload)

    def apart(self, share: float, only: int | None = None) -> Stage:
        """Return differences of the pressures about a mean, in one joint or in all."""
        low: dict[str, float] = {}
        high: dict[str, float] = {}
        for k, joint in enumerate(self.joints):
            least, most = span(joint)
            mean = least + share * (most - least)
            (a, first), (b, second) = joint.items()
            recorded = 0.5 * (first - second)
            room = min(mean - least, most - mean)
            ends = np.clip([recorded.min(), recorded.max()], -room, room)
            if only is not None and only != k:
                ends = np.full(2, ends.mean())
            (low[a], high[a]), (low[b], high[b]) = (mean + ends).tolist(), (mean - ends).tolist()
        return Stage(low, high, self.payload)

    def mean_bar(self, share: float) -> str:
        """Return the mean pressures [bar] of the joints, in words."""
        ends = [span(joint) for joint in self.joints]
        means = dict.fromkeys(f"{(a + share * (b - a)) / BAR:.3g}" for a, b in ends)
        return " or ".join(means)


def span(joint: Mapping[str, Array]) -> tuple[float, float]:
    """Return the smallest and the largest pressure [Pa] that each muscle of a joint had."""
    least = max(0.0, *(float(v.min()) for v in joint.values()))
    return least, max(least, min(float(v.max()) for v in joint.values()))


def channel_plans(means: ChannelMeans) -> tuple[ChannelPlan, ...]:
    """Return the experiments that a rig can do and that change a pressure."""
    pairs = all(len(joint) == 2 for joint in means.joints)
    made = _of_pairs(means) if pairs else _of_one_muscle(means)
    return tuple(plan for plan in made if all(s.low != s.high for s in plan.stages))


def _of_one_muscle(means: ChannelMeans) -> Iterator[ChannelPlan]:
    for name, words, pieces in listed_pieces(means.shut):
        yield ChannelPlan(name, words, pieces, (means.equal(),))


def _of_pairs(means: ChannelMeans) -> Iterator[ChannelPlan]:
    joints = range(len(means.joints))
    of = " of each joint, all joints alike," if len(joints) > 1 else ""
    together = "vary the difference of the two pressures"
    usual, mean = means.apart(USUAL), means.mean_bar(USUAL)
    for name, words, pieces in listed_pieces(means.shut):
        if name != FILLING:
            about = words.replace("half the pressure", "its middle")
            about = about.replace("one pressure", "one value")
            at = f" at a mean of {mean} bar: {about}"
            yield ChannelPlan(name, f"{together}{of}{at}", pieces, (usual,))
            for k in joints if len(joints) > 1 and name in ALONE else ():
                alone = f"{together} of joint {k} alone{at}"
                yield ChannelPlan(f"{name}_joint_{k}", alone, pieces, (means.apart(USUAL, k),))
        both = "the two pressures of each joint" if len(joints) > 1 else "both pressures"
        equal = f"keep {both} equal: {words}"
        yield ChannelPlan(f"{name}_equal", equal, pieces, (means.equal(),))
    slow = (REST, *TRIANGLE)
    two = f"{means.mean_bar(LOW)} bar, then {means.mean_bar(HIGH)} bar"
    words = f"{together}{of} at a mean of {two}: ramp up and down slowly"
    yield ChannelPlan("two_means", words, slow, (means.apart(LOW), means.apart(HIGH)))
    if len(means.payloads) > 1:
        several = tuple(dict.fromkeys(near(means.payloads, k / 4) for k in range(5)))
        loads = enumeration([f"{load:g}" for load in several])
        words = f"{together}{of} under {loads} kg in turn: ramp up and down slowly"
        stages = tuple(replace(usual, payload=load) for load in several)
        yield ChannelPlan("several_payloads", words, slow, stages)
