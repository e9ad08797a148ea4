"""Statistics against hand-computed numbers and scipy."""

import numpy as np
import pytest
from scipy import stats

from benchmarks.scoring import statistics


def test_interquartile_mean_equals_the_one_by_hand():
    # of eight the middle four: (2 + 3 + 4 + 5) / 4
    samples = np.array([[100.0, 2.0, 3.0, 4.0, 5.0, 1.0, 0.0, 50.0]])
    assert statistics.interquartile_mean(samples)[0] == 3.5


def test_probability_of_improvement_equals_the_one_by_hand():
    # two training seeds against one run, in three episodes: below twice, a tie, above
    first = np.array([[1.0, 5.0, 2.0], [2.0, 5.0, 9.0]])
    second = np.array([[3.0, 5.0, 4.0]])
    found = statistics.probability_of_improvement(first, second, ["a", "b", "c"])
    assert found.value == pytest.approx((1.0 + 0.5 + 0.5) / 3)
    other = statistics.probability_of_improvement(second, first, ["a", "b", "c"])
    assert other.value == pytest.approx(1.0 - found.value)


def test_probability_of_improvement_is_mann_whitney_averaged_over_tasks():
    random = np.random.default_rng(0)
    first = np.round(random.normal(0.0, 1.0, (7, 6)), 1)  # rounded: ties occur
    second = np.round(random.normal(0.3, 1.0, (5, 6)), 1)
    found = statistics.probability_of_improvement(first, second, np.arange(6))
    expected = [
        # U counts pairs in which the first argument is the larger
        stats.mannwhitneyu(second[:, k], first[:, k], method="asymptotic").statistic / 35
        for k in range(6)
    ]
    assert found.value == pytest.approx(np.mean(expected))
    assert found.low < found.value < found.high


def test_certain_improvement_has_a_point_interval_and_one_seed_in_two_a_full_one():
    always = statistics.probability_of_improvement(np.zeros((10, 6)), np.ones((1, 6)), [0, 1] * 3)
    assert always == statistics.Interval(1.0, 1.0, 1.0)
    half = np.repeat([[0.0], [2.0]], 6, axis=1)
    found = statistics.probability_of_improvement(half, np.ones((1, 6)), [0, 1] * 3)
    assert (found.value, found.low, found.high) == (0.5, 0.0, 1.0)


def test_bootstrap_resamples_whole_scenarios():
    # below in all of one scenario and in none of the other: one of two is drawn
    second = np.ones((1, 10))
    first = np.repeat([[0.0, 2.0]], 5, axis=1)
    found = statistics.probability_of_improvement(first, second, np.repeat(["a", "b"], 5))
    assert (found.value, found.low, found.high) == (0.5, 0.0, 1.0)


def test_performance_profile_equals_the_one_by_hand():
    scores = np.array([[1.0, 2.0], [3.0, 2.0]])
    found = statistics.performance_profile(scores, [0.5, 1.0, 2.0, 2.5, 3.0])
    assert found.tolist() == [0.0, 0.25, 0.75, 0.75, 1.0]


def interval(samples: np.ndarray, strata: object, **how: int) -> statistics.Interval:
    """Return the mean of one run's episodes with its interval."""
    return statistics.of_table(np.asarray(samples, float)[None], strata, **how)


def test_interval_is_students_t_within_strata():
    sample, strata = np.random.default_rng(0).normal(3.0, 1.0, 400), np.zeros(400, int)
    exact = stats.t.interval(0.95, 399, sample.mean(), stats.sem(sample))
    found = interval(sample, strata)
    assert found.value == pytest.approx(sample.mean())
    assert (found.low, found.high) == pytest.approx(exact, abs=0.02)
    assert interval(sample, strata) == found
    # strata of their own level: the interval is that of the scatter within them
    levels = np.repeat([0.0, 100.0], 200)
    split = interval(sample + levels, np.repeat([0, 1], 200))
    assert split.high - split.low < 0.3


def test_interval_includes_the_scatter_of_training_seeds():
    # seeds differ by normal offsets, episodes do not: the interval is that of the mean of ten seeds
    offsets = np.random.default_rng(1).normal(0.0, 1.0, 10)
    table, strata = np.repeat(offsets[:, None], 6, axis=1), [0, 0, 0, 1, 1, 1]
    found = statistics.of_table(table, strata)
    assert found.value == pytest.approx(offsets.mean())
    width = 1.96 * offsets.std(ddof=1) / np.sqrt(10)
    assert 0.5 * (found.high - found.low) == pytest.approx(width, rel=0.06)
    blind = interval(table.ravel(), strata * 10)
    assert blind.high - blind.low < 0.5 * (found.high - found.low)


def test_episode_order_does_not_affect_training_seeds():
    runs = np.repeat([4, 5, 6], 4).tolist()
    pairs = [("a", 1), ("a", 2), ("b", 1), ("b", 2)] * 3
    values = np.random.default_rng(3).normal(size=12)
    for turn in (1, -1):
        table, order = statistics.crossed(values[::turn], runs[::turn], pairs[::turn])
        assert table.tolist() == values.reshape(3, 4).tolist()
        assert order == pairs[:4]


def test_paired_difference_is_significant_despite_overlapping_intervals():
    # hard and easy episodes differ by far more than the two controllers do
    random = np.random.default_rng(4)
    hardness = random.uniform(1.0, 10.0, (1, 20))
    strata = [0] * 20
    first, second = hardness, hardness + 0.1 + 0.01 * random.normal(size=(1, 20))
    alone = [interval(table[0], strata) for table in (first, second)]
    assert alone[1].low < alone[0].high
    found = statistics.difference_of_tables(second, first, strata)
    assert found.low > 0.09
    assert found.high < 0.11


def test_differences_of_several_training_seeds_equal_those_by_hand():
    first, second = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[1.0, 1.0]])
    found = statistics.difference_of_tables(first, second, ["a", "b"])
    assert found.value == pytest.approx(1.5)
    # one of two seeds is drawn: the mean of the first less 1, or of the second less 1
    assert (found.low, found.high) == (pytest.approx(0.5), pytest.approx(2.5))


def test_intervals_do_not_depend_on_previous_calls():
    random = np.random.default_rng(5)
    first, second = random.normal(size=(10, 12)), random.normal(size=(1, 12))
    strata = np.repeat([0, 1, 2], 4)
    before = statistics.probability_of_improvement(first, second, strata)
    statistics.probability_of_improvement(second, first, strata)
    assert statistics.probability_of_improvement(first, second, strata) == before


def test_incomplete_tables_are_refused():
    with pytest.raises(ValueError, match="the same seeds"):
        statistics.probability_of_improvement(np.zeros((1, 3)), np.ones((1, 3)), [0, 0, 1])
    with pytest.raises(ValueError, match="every training seed must be run in every episode"):
        statistics.crossed(np.ones(3), [0, 0, 1], ["a", "b", "a"])


def covered(random: np.random.Generator) -> bool:
    """Return whether the interval of 30 unlike scenarios x 5 seeds holds the true mean, 0."""
    levels = np.linspace(-10.0, 10.0, 30)[:, None]
    strata = np.repeat(np.arange(30), 5)
    found = interval((levels + random.normal(size=(30, 5))).ravel(), strata, resamples=400)
    return found.low <= 0.0 <= found.high


def test_interval_has_its_coverage_with_independent_scenario_seeds():
    random = np.random.default_rng(7)
    share = np.mean([covered(random) for _ in range(4000)])
    assert 0.925 <= share <= 0.965  # 400 resamples give 0.94; a standard error is 0.004


def audited(random: np.random.Generator) -> bool:
    """Return whether the interval of 15 scenarios x 2 seeds and 10 trainings holds the mean, 0."""
    table = random.normal(size=(10, 1)) + random.normal(size=(1, 30))
    found = statistics.of_table(table, np.repeat(np.arange(15), 2), resamples=400)
    return found.low <= 0.0 <= found.high


def test_audit_interval_has_its_coverage():
    random = np.random.default_rng(9)
    share = np.mean([audited(random) for _ in range(400)])
    assert 0.89 <= share <= 0.96  # 0.92: ten policies, and no Student's t


def test_gap_between_splits_is_paired_by_training_seed():
    random = np.random.default_rng(10)
    policies = random.normal(0.0, 5.0, (10, 1))
    public = policies + 0.1 * random.normal(size=(10, 12))
    audit = policies + 0.5 + 0.1 * random.normal(size=(10, 30))
    strata = np.repeat(np.arange(6), 2), np.repeat(np.arange(6), 5)
    found = statistics.difference_of_splits(audit, strata[1], public, strata[0])
    assert found.value == pytest.approx(audit.mean() - public.mean())
    assert found.low > 0.4
    assert found.high < 0.6


def test_profile_band_uses_the_resamples_of_the_mean():
    random = np.random.default_rng(11)
    scores, strata = random.normal(size=(4, 12)), np.repeat([0, 1, 2], 4)
    low, high = statistics.profile_band(scores, strata, [-9.0, 0.0, 9.0], resamples=300)
    assert (low[0], high[0], low[2], high[2]) == (0.0, 0.0, 1.0, 1.0)
    share = statistics.of_table((scores <= 0.0).astype(float), strata, resamples=300)
    assert (low[1], high[1]) == (pytest.approx(share.low), pytest.approx(share.high))


def test_reduction_is_of_means_over_the_same_resamples():
    """A constant ratio has an interval of no width, however much the episodes differ."""
    theirs = np.array([[1.0, 5.0, 2.0, 30.0, 0.1, 7.0]])
    strata = list("aaabbb")
    found = statistics.reduction_of_tables(0.25 * theirs, theirs, strata)
    assert [found.value, found.low, found.high] == pytest.approx([0.75, 0.75, 0.75])
    random = np.random.default_rng(0)
    ours = theirs * random.uniform(0.05, 0.9, theirs.shape)
    found = statistics.reduction_of_tables(ours, theirs, strata)
    assert found.value == pytest.approx(1.0 - ours.mean() / theirs.mean())
    assert found.low < found.value < found.high < 1.0
    several = statistics.reduction_of_tables(np.vstack([ours, 0.9 * ours]), theirs, strata)
    assert several.value == pytest.approx(1.0 - 0.95 * ours.mean() / theirs.mean())
    assert several.low < several.value < several.high < 1.0
    assert np.isnan(statistics.reduction_of_tables(ours, 0.0 * theirs, strata).value)
