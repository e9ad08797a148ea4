"""Disjoint environment seeds for training and for tuning, apart from those of benchmarks.

Training uses seeds from ``TRAINING`` on; evaluations that choose settings and policies use the
seeds from ``TUNING`` on, data sets those from ``DATA`` on. Scenarios use seeds below ``TUNING``,
and each audit round draws its own. Scored episodes are therefore used neither in training nor in
the choice of settings.
"""

TUNING = 900_000
MOST_TUNING = 1_000
DATA = 910_000
MOST_DATA = 10_000  # episodes of one kind
TRAINING = 1_000_000


def first_training(seed: int) -> int:
    """Return the seed of the first row of training seed ``seed``; row ``i`` adds ``i``."""
    return TRAINING * (seed + 1)


def tuning(count: int) -> list[int]:
    """Return the seeds of ``count`` tuning episodes; a ValueError if there are fewer."""
    if not 1 <= count <= MOST_TUNING:
        raise ValueError(
            f"evaluation.episodes = {count} must be from 1 to {MOST_TUNING}, the number of tuning "
            "seeds; choose fewer"
        )
    return list(range(TUNING, TUNING + count))


def dataset(kind: int, first: int, count: int) -> list[int]:
    """Return the seeds of ``count`` episodes from ``first`` on, of a data set's kind (a number)."""
    if first + count > MOST_DATA:
        raise ValueError(
            f"a data set has at most {MOST_DATA} episodes, and {first + count} are needed; choose "
            "fewer steps"
        )
    begin = DATA + MOST_DATA * kind + first
    return list(range(begin, begin + count))
