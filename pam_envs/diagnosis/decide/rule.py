"""Decision rule: its thresholds, and the verdict on plain evidence.

The thresholds were set on drawn cases that no benchmark reports.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Rule:
    """Thresholds of the decision."""

    version: str = "14"  # part of every report
    least_gain: float = 0.1  # log mean-square gain on held-out blocks below which no cause is named
    least_total: float = 2.4  # the same, times the number of held-out blocks, for short recordings
    # the same on a rig whose law or friction differs from the base, of any cause and of one that is
    # like another law: a smaller gain may correct what is left of that difference
    differing_gain: float = 0.35
    differing_lawlike: float = 0.6
    trial_penalty: float = (
        0.01  # multiple-comparison penalty: gain lost for each factor e of trials
    )
    # structure of a residual: share explained by a flexible model, height of a spectral peak over
    # its neighbourhood, held-out mean square over that of the noise floor
    flexible: float = 0.15
    peak: float = 30.0
    excess: float = 1.6
    # removed share of the excess below which structure is unexplained, and below which a name is
    # incomplete; where this share of a spectral peak remains at its frequency, what oscillates has
    # no name yet, and the share must be larger
    explained: float = 0.3
    complete: float = 0.5
    lasting: float = 0.5
    explained_with_peak: float = 0.9
    # mean square over the noise of a pressure above which a cause must explain its share there too
    lost: float = 3.0
    # a rival within this share of the best gain, or this far below it, is not excluded, unless the
    # difference is significant at the level of doubt (one-sided, block bootstrap)
    close: float = 0.8
    apart: float = 0.1
    least_blocks: int = 6  # number of held-out blocks with motion that a decision needs
    doubt: float = 0.05
    # gain of a common difference from the base (another law, another drive of the friction) above
    # which it is named; a smaller one is a calibration
    common_gain: float = 0.3
    # gain of a further cause that is like another law
    lawlike_further: float = 1.0
    # gain of a common difference that is like another law and that few rigs have
    unusual_gain: float = 1.5
    # a further cause needs a least gain, and this share of the first cause's gain, or this gain, or
    # this share of the gain of a model that leaves only noise: otherwise it corrects the first form
    second_gain: float = 0.1
    second_share: float = 0.3
    second_enough: float = 0.6
    second_clear: float = 0.75
    hint: float = 0.4  # share of the required gain that a further search must reach at first
    beam: int = 3  # number of first causes from which a second is searched
    most: int = 6  # largest number of named causes
    # gain, and share of the gain, that a cause must have over one that it contains
    simpler: float = 0.05
    simpler_share: float = 0.03
    folds: int = 3  # folds of the cross-validation of close rivals
    draws: int = 400  # bootstrap samples


SAME_FREQUENCY = 0.1
"""Relative difference of frequencies that are the same."""
LITTLE = 0.3
"""Mean square above the noise of which no share is judged."""


@dataclass(frozen=True)
class Judgement:
    """A verdict on plain evidence.

    Number of causes, the rivals that are not excluded, and whether what is named leaves structure
    that no cause explains.
    """

    verdict: str
    level: int
    open_rivals: tuple[int, ...] = ()
    incomplete: bool = False


def judge(evidence: Mapping[str, Any], rule: Rule) -> Judgement:
    """Return the verdict on evidence (``pam_envs.diagnosis.decide.verdict.Ladder.evidence``)."""
    levels = evidence["levels"]
    least = max(rule.least_gain, rule.least_total / max(1, evidence["blocks"]))
    first_least = least
    if evidence.get("differs", False):
        lawlike = len(levels) > 1 and levels[1].get("lawlike", False)
        least = max(least, rule.differing_gain)
        first_least = max(least, rule.differing_lawlike if lawlike else 0.0)
    if len(levels) < 2 or not is_accepted(levels[1], first_least, rule):
        if has_structure(levels[0]["left"], rule):
            return unexplained(evidence, 0, rule)
        return Judgement("adequate", 0)
    level, first = 1, levels[1]["gain"]
    while level + 1 < len(levels) and level < rule.most:
        required = max(least, required_gain(first, levels[level + 1]["possible"], rule))
        if levels[level + 1].get("lawlike", False):
            required = max(required, rule.lawlike_further)
        if not is_accepted(levels[level + 1], required, rule):
            break
        level += 1
    found, incomplete = levels[level], False
    if has_structure(found["left"], rule):
        lasts = oscillates_still(levels[0]["left"], found["left"], rule)
        share = explained_fraction(levels[0], found)
        if share < (rule.explained_with_peak if lasts else rule.explained) or is_lost(
            levels[0], found, evidence.get("driving", ()), rule
        ):
            return unexplained(evidence, level, rule)
        incomplete = share < rule.complete
    still = not_excluded(found["rivals"], rule)
    return Judgement("ambiguous" if still else "named", level, still, incomplete)


def unexplained(evidence: Mapping[str, Any], level: int, rule: Rule) -> Judgement:
    """Return the verdict where structure remains: a fault of the base is named if it is shown."""
    if any(is_shown(fault, rule) for fault in evidence.get("faults", ())):
        return Judgement("named", 0, incomplete=True)
    return Judgement("unexplained", level)


def is_shown(fault: Mapping[str, Any], rule: Rule) -> bool:
    """Return whether a fault of the base explains a large share that no other cause does.

    It needs the gain of a difference beside another law, a significant one, and most of the mean
    square above the noise without it; every other cause in its place gains clearly less.
    """
    return bool(
        fault["gain"] >= rule.lawlike_further
        and fault["unsure"] <= rule.doubt
        and explained_fraction({"left": fault["without"]}, {"left": fault["left"]}) >= rule.complete
        and fault["rival"] < rule.close * fault["gain"]
    )


def oscillates_still(before: Mapping[str, Any], after: Mapping[str, Any], rule: Rule) -> bool:
    """Return whether a spectral peak remains in a channel, at the same frequency.

    Heights are relative to a neighbourhood, which falls with the mean square of the channel.
    """
    rows = zip(
        before["peaks"], before["by_channel"], after["peaks"], after["by_channel"], strict=True
    )
    return any(
        was > rule.peak
        and now > rule.peak
        and now * left > rule.lasting * was * square
        and abs(frequency - known) < SAME_FREQUENCY * known
        for (known, was), square, (frequency, now), left in rows
    )


def has_structure(left: dict[str, Any], rule: Rule) -> bool:
    """Return whether a residual contains more than noise."""
    return bool(
        max(left["r2"]) > rule.flexible or left["peak"] > rule.peak or left["excess"] > rule.excess
    )


def required_gain(first: float, possible: float, rule: Rule) -> float:
    """Return the gain that a further cause needs."""
    ways = (rule.second_share * first, rule.second_enough, rule.second_clear * possible)
    return max(rule.second_gain, min(ways))


def is_accepted(level: Mapping[str, Any], required: float, rule: Rule) -> bool:
    """Return whether a further cause has the required gain, and a significant one.

    No cause gains more than a model that leaves only noise: where it does, a fit has failed.
    """
    gained = min(level["added"], level["possible"])
    return bool(gained >= required and level["unsure"] <= rule.doubt)


def explained_fraction(before: Mapping[str, Any], after: Mapping[str, Any]) -> float:
    """Return the removed share of the mean square above the noise, on the channel with the most.

    Infinite if there was none.
    """
    pairs = zip(before["left"]["by_channel"], after["left"]["by_channel"], strict=True)
    shares = [1.0 - (now - 1.0) / (was - 1.0) for was, now in pairs if was > 1.0 + LITTLE]
    return max(shares, default=np.inf)


def is_lost(
    before: Mapping[str, Any], after: Mapping[str, Any], driving: Sequence[int], rule: Rule
) -> bool:
    """Return whether a channel that drives the others keeps most of a large misfit.

    Causes that leave it may only make up for it in another channel.
    """
    pairs = [(level["left"]["by_channel"][k] for level in (before, after)) for k in driving]
    return any(
        now > rule.lost and now - 1.0 > (1.0 - rule.complete) * (was - 1.0) for was, now in pairs
    )


def not_excluded(rivals: Sequence[Mapping[str, Any]], rule: Rule) -> tuple[int, ...]:
    """Return the indices of rivals that are close to the first and not significantly worse."""
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
