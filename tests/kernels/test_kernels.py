"""Arithmetic without libm, random numbers, and the builder of kernels."""

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from pam_envs.kernels import arithmetic, random
from pam_envs.kernels import build as kernels
from pam_envs.kernels.build import prange
from pam_envs.kernels.motion import damped_motion, oscillator
from pam_envs.kernels.rebind import Bound, rebind

ROOT = Path(__file__).resolve().parents[2]


def test_decay_equals_the_exponential() -> None:
    x = np.linspace(-3.0, 5.0, 801)
    assert max(abs(arithmetic.decay(v) / math.exp(-v) - 1.0) for v in x.tolist()) < 2e-13
    x = np.linspace(5.0, 20.0, 301)
    assert max(abs(arithmetic.decay(v) / math.exp(-v) - 1.0) for v in x.tolist()) < 1e-9
    assert arithmetic.decay(0.0) == 1.0
    assert arithmetic.decay(1e9) == arithmetic.decay(40.0) > 0.0


def test_sine_of_turns_equals_the_sine() -> None:
    x = np.linspace(-30.0, 30.0, 4001).tolist()
    assert max(abs(arithmetic.sine_of_turns(v) - math.sin(2 * math.pi * v)) for v in x) < 1e-13
    assert arithmetic.sine_of_turns(0.0) == 0.0


def test_logarithm_and_normal_quantile_equal_references() -> None:
    u = np.concatenate([np.logspace(-9.9, -0.31, 800), 1.0 - np.logspace(-9.0, -0.31, 800)])
    assert max(abs(arithmetic.log_of_fraction(v) - math.log(v)) for v in u.tolist()) < 1e-11
    got = np.array([random.normal_quantile(v) for v in u.tolist()])
    assert np.abs(got - stats.norm.ppf(u)).max() < 1e-6


@pytest.mark.parametrize(
    ("value", "step", "expected"), [(0.26, 0.1, 0.3), (-0.26, 0.1, -0.3), (1.7, 0.0, 1.7)]
)
def test_quantise_rounds_to_the_nearest_step(value: float, step: float, expected: float) -> None:
    assert arithmetic.quantise(value, step) == pytest.approx(expected, abs=1e-15)


def test_oscillator_covers_both_kinds_of_motion() -> None:
    for phase in np.linspace(0.05, 9.0, 60).tolist():
        c, s = oscillator(phase)
        root = math.sqrt(phase)
        assert c == pytest.approx(math.cos(root), abs=2e-7)
        assert s == pytest.approx(math.sin(root) / root, abs=2e-7)
        c, s = oscillator(-phase)
        assert c == pytest.approx(math.cosh(root), rel=2e-7)
        assert s == pytest.approx(math.sinh(root) / root, rel=2e-7)
    assert oscillator(0.0) == (1.0, 1.0)


@pytest.mark.parametrize("damping", [0.0, 20.0, 1200.0])
def test_damped_motion_solves_its_equation(damping: float) -> None:
    from scipy.integrate import solve_ivp

    v0, a, j, k, h = 0.03, 2.0, -400.0, 9e4, 0.005
    exact = solve_ivp(
        lambda t, y: [y[1], a + j * t - k * y[0] - damping * y[1]],
        (0.0, h),
        [0.0, v0],
        rtol=1e-11,
        atol=1e-14,
    ).y[:, -1]
    got = damped_motion(v0, a, j, k, damping, arithmetic.decay(0.5 * damping * h), h)
    assert got == pytest.approx(tuple(exact), rel=1e-6, abs=1e-10)


def test_mix_is_a_bijection_that_spreads_one_bit() -> None:
    words = np.random.default_rng(0).integers(0, 2**32, 20000).tolist()
    assert len({random.mix(w) for w in set(words)}) == len(set(words))
    flips = np.zeros(32)
    for w in words[:500]:
        for bit in range(32):
            flips[bit] += (random.mix(w) ^ random.mix(w ^ (1 << bit))).bit_count()
    assert np.abs(flips / 500 - 16.0).max() < 0.6


def draws(seed: int, episode: int, stream: int, number: int) -> np.ndarray:
    a, b = random.seed_words(seed)
    a, b = random.episode_key(a, episode), random.episode_key(b, episode)
    return np.array([random.uniform(a, b, stream, i) for i in range(number)])


def test_uniform_numbers_are_uniform_and_independent() -> None:
    sample = draws(0, 0, 1, 20000)
    assert stats.kstest(sample, "uniform").pvalue > 1e-3
    for lag in (1, 2, 3, 7):
        assert abs(np.corrcoef(sample[lag:], sample[:-lag])[0, 1]) < 0.03
    for other in (draws(1, 0, 1, 20000), draws(0, 1, 1, 20000), draws(0, 0, 2, 20000)):
        assert abs(np.corrcoef(sample, other)[0, 1]) < 0.03
    pairs, _, _ = np.histogram2d(sample[::2], sample[1::2], bins=16, range=[[0, 1], [0, 1]])
    assert stats.chisquare(pairs.ravel()).pvalue > 1e-3


def test_first_draws_of_neighbouring_seeds_and_episodes_are_independent() -> None:
    seeds = np.array([draws(s, 0, 3, 2) for s in range(4000)])
    episodes = np.array([draws(7, e, 3, 2) for e in range(4000)])
    for sample in (seeds, episodes):
        assert stats.kstest(sample[:, 0], "uniform").pvalue > 1e-3
        assert abs(np.corrcoef(sample[1:, 0], sample[:-1, 0])[0, 1]) < 0.06
        assert abs(np.corrcoef(sample.T)[0, 1]) < 0.06


def test_normal_numbers_are_normal() -> None:
    a, b = random.seed_words(12)
    sample = np.array([random.normal(a, b, 1, i) for i in range(20000)])
    assert stats.kstest(sample, "norm").pvalue > 1e-3
    assert abs(sample.std() - 1.0) < 0.02


def test_seeds_of_any_size_differ() -> None:
    seeds = [0, 1, 2**31, 2**32, 2**32 + 1, 2**64, 2**100, 2**100 + 1]
    assert len({random.seed_words(s) for s in seeds}) == len(seeds)
    with pytest.raises(ValueError, match="non-negative"):
        random.seed_words(-1)


@kernels.kernel
def _inner(x: float) -> float:
    return x + OFFSET


OFFSET = 1


@kernels.kernel
def _outer(x: float) -> float:
    return 2.0 * _inner(x)


def test_build_replaces_names_through_the_call_graph() -> None:
    plain = kernels.build(_outer, "plain_for_test")
    moved = kernels.build(_outer, "moved_for_test", OFFSET=10)
    assert (plain(1.0), moved(1.0), _outer(1.0)) == (4.0, 22.0, 4.0)
    assert kernels.interpreted(_outer, {"OFFSET": 5})(1.0) == 12.0


@kernels.kernel
def _doubled(x: float) -> float:
    return x + x


@kernels.kernel
def _both(x: float) -> float:
    return _inner(x) + _doubled(x)


def test_callees_are_built_once_for_each_binding() -> None:
    made: list[tuple[str, set[tuple[str, object]]]] = []

    def finish(copy: Any, original: Any, bound: Bound) -> Any:
        made.append((original.__name__, set(bound)))
        return copy

    done: dict[Any, Any] = {}
    first, again, other = (
        rebind(_both, {"OFFSET": offset, "unused": unused}, finish, done)
        for offset, unused in ((10, 1), (10, 2), (20, 1))
    )
    assert first is not again
    assert (first(1.0), again(1.0), other(1.0)) == (13.0, 13.0, 23.0)
    ten, twenty = {("OFFSET", 10)}, {("OFFSET", 20)}
    assert sorted(made, key=str) == sorted(
        [
            ("_inner", ten),
            ("_doubled", set()),
            ("_both", ten),
            ("_both", ten),
            ("_inner", twenty),
            ("_both", twenty),
        ],
        key=str,
    )


@kernels.kernel
def _spread(n: int) -> float:
    total = 0.0
    for k in prange(n):
        total += _inner(1.0 * k)
    return total


def run(cache: Path, *arguments: str, paths: tuple[Path, ...] = (ROOT,)) -> list[str]:
    """Return the words that a new Python process with its own cache of machine code prints."""
    known = os.pathsep.join(map(str, paths))
    variables = {**os.environ, "PYTHONPATH": known, "PAM_ENVS_CACHE": str(cache)}
    command = [sys.executable, *arguments]
    done = subprocess.run(
        command, env=variables, cwd=ROOT, check=True, capture_output=True, text=True
    )
    return done.stdout.split()


cached = pytest.mark.skipif(not kernels.COMPILED, reason="nothing is kept on disk")

_KEPT = """
from pam_envs.kernels.build import build, kernel
OFFSET = {offset}
@kernel
def inner(x):
    "{docstring}"
    return x + OFFSET
def outer(x):
    # {docstring}
    return inner(x) * 2.0
print(build(outer, "kept")(1.0))
"""


@cached
def test_cached_code_depends_on_values_and_not_on_docstrings(tmp_path: Path) -> None:
    cache, script = tmp_path / "cache", tmp_path / "kept.py"

    def built(**values: object) -> list[str]:
        script.write_text(_KEPT.format(**values))
        return run(cache, str(script))

    assert built(offset=1.0, docstring="Add the offset.") == ["4.0"]
    before = {p: p.stat().st_mtime_ns for p in cache.iterdir()}
    assert sorted(p.suffix for p in before) == [".nbc", ".nbi"]
    assert built(offset=1.0, docstring="Return the sum.") == ["4.0"]
    assert {p: p.stat().st_mtime_ns for p in cache.iterdir()} == before
    assert built(offset=2.0, docstring="Return the sum.") == ["6.0"]
    assert len(list(cache.iterdir())) == 4


_READ_ONLY = """
import tempfile
from pam_envs.kernels import compiler
def refuse(*_, **__):
    raise PermissionError("read-only")
tempfile.TemporaryFile = compiler.write_whole = refuse
import {name}
print(sum({name}.made.stats.cache_hits.values()))
"""


@cached
def test_cached_code_is_used_where_nothing_can_be_written(tmp_path: Path) -> None:
    cache, name = tmp_path / "cache", "read_only"
    source = _KEPT.format(offset=4.0, docstring="Add.")
    called = "made = build(outer, 'kept'); print(made(1.0))"
    text = source.replace('print(build(outer, "kept")(1.0))', called)
    (tmp_path / f"{name}.py").write_text(text)
    code = _READ_ONLY.format(name=name)
    paths = (ROOT, tmp_path)
    assert run(cache, "-c", code, paths=paths) == ["10.0", "0"]  # compiled, not kept
    assert run(cache, "-c", f"import {name}", paths=paths) == ["10.0"]
    assert run(cache, "-c", code, paths=paths) == ["10.0", "1"]  # from the disk


@cached
def test_cached_code_survives_a_move_of_its_module(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    source = _KEPT.format(offset=3.0, docstring="Add.").replace("print(build", "made = (build")
    for name in ("before_the_move", "after_the_move"):
        (tmp_path / f"{name}.py").write_text(source)
        code = f"import {name}; print({name}.made)"
        assert run(cache, "-c", code, paths=(ROOT, tmp_path)) == ["8.0"]
        (tmp_path / f"{name}.py").unlink()
        assert sorted(p.suffix for p in cache.iterdir()) == [".nbc", ".nbi"]


_BUILT_APART = """
import sys
import numpy as np
from pam_envs.kernels.build import build, kernel, routine
last = None
@kernel
def one(x): return x + 1.0
@kernel
def two(x): return x + 2.0
@routine
def between(rows, n, x):
    total = 0.0
    for k in range(n):
        for m in range(n):
            if rows[k][m] > 0.5:
                total = total + last(x) * k
            else:
                rows[k][m] = total
                total = total - last(rows[m][k]) / (1.0 + k * m)
        if total > 100.0 * n:
            total = total * 0.5
    return total
@kernel
def top(rows, n):
    s = 0.0
    for i in range(n):
        s = s + between(rows, n, 1.0 * i) + between(rows, n - 1, s) * between(rows, n - 2, 2.0)
    return s + between(rows, n, 1.0)
for name in sys.argv[1:]:
    made = build(top, f"top_{name}", last=globals()[name])
    print(made(np.zeros((4, 4)), 4))
"""


@cached
def test_kernels_compiled_in_separate_processes_run_in_one(tmp_path: Path) -> None:
    cache, script = tmp_path / "cache", tmp_path / "apart.py"
    script.write_text(_BUILT_APART)
    one, two = run(cache, str(script), "one"), run(cache, str(script), "two")
    assert one != two
    assert run(cache, str(script), "one", "two") == [*one, *two]


@cached
def test_other_values_or_parallel_loops_are_cached_in_another_file(tmp_path: Path) -> None:
    code = """
import tests.kernels.test_kernels as t
for parallel, offset in ((False, 1), (True, 1), (False, 5)):
    print(t.kernels.build(t._spread, "spread", parallel, OFFSET=offset)(3))
"""
    for _ in range(2):  # compiled, then from the disk
        assert run(tmp_path, "-c", code) == ["6.0", "6.0", "18.0"]
    assert sum(path.suffix == ".nbi" for path in tmp_path.iterdir()) == 3
