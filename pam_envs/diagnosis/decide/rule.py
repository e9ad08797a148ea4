"""The rule of a diagnosis: numbers, and how they word a verdict on plain evidence.

Its thresholds were chosen on drawn cases that no benchmark reports.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Rule:
    """The numbers of the decision.

    Attributes
    ----------
    version : str
        Part of every report.
    least_gain : float
        Log mean-square gain on held-out blocks below which nothing is called missing.
    least_total : float
        The same, times the number of held-out blocks: what little data has to gain.
    look : float
        What a gain loses for each factor of e in the number of beginnings its best was chosen from.
    flexible : float
        Share of a residual that a flexible model may explain before it counts as structure.
    peak : float
        Height of a spectral peak, over its neighbourhood, that counts as structure.
    excess : float
        Held-out mean square over that of the noise floor that counts as structure.
    explained : float
        Unexplained when structure is left and less of the excess than this part has gone.
    least_blocks : int
        With fewer held-out blocks in which something moves nothing is decided.
    close, apart : float
        A rival within this part of the best gain, or no further below it than this, is not
        excluded...
    doubt : float
        ... if the difference is not surer than this (one-sided, blocks drawn again).
    second_gain : float
        A further cause has to gain this much...
    second_share, second_enough, second_clear : float
        ... and this part of the first's gain, or this much, or this part of what a model that
        leaves nothing but noise would: else it corrects the form of the first.
    hint : float
        A search for a further cause goes on if its first rounds promise this part of it.
    beam : int
        First causes from which a second is looked for.
    most : int
        Most causes named.
    simpler, simpler_share : float
        What a cause that contains another one must gain over it, and what part of the gain.
    folds : int
        Ways to hold blocks out on which close rivals are compared.
    draws : int
        Bootstrap samples.
    """

    version: str = "2"
    least_gain: float = 0.1
    least_total: float = 2.4
    trial_penalty: float = 0.01
    flexible: float = 0.15
    peak: float = 30.0
    excess: float = 1.6
    explained: float = 0.6
    close: float = 0.8
    apart: float = 0.1
    least_blocks: int = 6
    doubt: float = 0.05
    second_gain: float = 0.1
    second_share: float = 0.3
    second_enough: float = 0.6
    second_clear: float = 0.75
    hint: float = 0.4
    beam: int = 3
    most: int = 3
    simpler: float = 0.05
    simpler_share: float = 0.03
    folds: int = 3
    draws: int = 400


@dataclass(frozen=True)
class Judgement:
    """A verdict on plain evidence: how many causes, and which rivals are not excluded."""

    verdict: str
    level: int
    open_rivals: tuple[int, ...] = ()


def judge(evidence: Mapping[str, Any], rule: Rule) -> Judgement:
    """Word the verdict on evidence.

    Parameters
    ----------
    evidence : mapping
        From :func:`evidence_of`.
    rule : Rule
        The numbers of the decision.
    """
    levels = evidence["levels"]
    least = max(rule.least_gain, rule.least_total / max(1, evidence["blocks"]))
    if len(levels) < 2 or not is_accepted(levels[1], least, rule):
        return Judgement("unexplained" if structured(levels[0]["left"], rule) else "adequate", 0)
    level, first = 1, levels[1]["gain"]
    while level + 1 < len(levels) and level < rule.most:
        wanted = max(least, required_gain(first, levels[level + 1]["possible"], rule))
        if not is_accepted(levels[level + 1], wanted, rule):
            break
        level += 1
    found = levels[level]
    if structured(found["left"], rule) and explained_fraction(levels[0], found) < rule.explained:
        return Judgement("unexplained", level)
    still = not_excluded(found["rivals"], rule)
    return Judgement("ambiguous" if still else "named", level, still)


def structured(left: dict[str, Any], rule: Rule) -> bool:
    """Return whether there is more in a residual than noise."""
    return bool(
        max(left["r2"]) > rule.flexible or left["peak"] > rule.peak or left["excess"] > rule.excess
    )


def required_gain(first: float, possible: float, rule: Rule) -> float:
    """Return what a further cause has to gain, after a first that gained so much.

    Parameters
    ----------
    first : float
        Gain of the first cause.
    possible : float
        Gain of a model that leaves nothing but noise over what is named so far.
    rule : Rule
        The numbers of the decision.
    """
    ways = (rule.second_share * first, rule.second_enough, rule.second_clear * possible)
    return max(rule.second_gain, min(ways))


def is_accepted(level: Mapping[str, Any], wanted: float, rule: Rule) -> bool:
    """Return whether a further cause gains as much as is wanted, and surely gains."""
    return bool(level["added"] >= wanted and level["unsure"] <= rule.doubt)


def explained_fraction(before: Mapping[str, Any], after: Mapping[str, Any]) -> float:
    """Return the part of the mean square over the noise that is gone (infinite: of none)."""
    over = float(before["left"]["excess"]) - 1.0
    return 1.0 - (float(after["left"]["excess"]) - 1.0) / over if over > 0.0 else np.inf


def not_excluded(rivals: Sequence[Mapping[str, Any]], rule: Rule) -> tuple[int, ...]:
    """Return which rivals are close to the first and not surely worse."""
    best = rivals[0]
    return tuple(
        k
        for k, rival in enumerate(rivals)
        if set(rival["names"]) != set(best["names"])
        and len(rival["names"]) == len(best["names"])
        and not rival["imitates"]
        and not rival.get("out", False)
        and rival["gain"] >= min(rule.close * best["gain"], best["gain"] - rule.apart)
        and rival["gain"] > 0.0
        and rival["better"] > rule.doubt
    )
