"""Counter-based random numbers: a function of (seed, episode, stream, draw)."""

import math

from pam_envs.kernels.arithmetic import log_of_fraction
from pam_envs.kernels.build import kernel


@kernel
def mix(x: int) -> int:
    """Return a 32-bit word that depends on every bit of the 32-bit word ``x`` (a bijection).

    Three multiply-and-xorshift rounds with the constants of the "triple32" search
    (C. Wellons, hash-prospector, public domain), whose bias is near that of a random permutation.
    """
    x = x ^ (x >> 17)
    x = (x * 0xED5AD4BB) & 0xFFFFFFFF
    x = x ^ (x >> 11)
    x = (x * 0xAC4C1B51) & 0xFFFFFFFF
    x = x ^ (x >> 15)
    x = (x * 0x31848BAB) & 0xFFFFFFFF
    return x ^ (x >> 14)


@kernel
def episode_key(seed_word: int, episode: int) -> int:
    """Return the key word of one episode from one key word of the seed."""
    return mix(seed_word ^ mix((episode + 0x5851F42D) & 0xFFFFFFFF))


@kernel
def random_word(key_a: int, key_b: int, stream: int, draw: int) -> int:
    """Return 32 random bits for one draw of one stream of one episode."""
    counter = draw * 0x9E3779B9 + stream * 0x85EBCA6B
    return mix((key_b ^ mix((key_a ^ counter) & 0xFFFFFFFF)) & 0xFFFFFFFF)


@kernel
def uniform(key_a: int, key_b: int, stream: int, draw: int) -> float:
    """Return a uniform number in (0, 1)."""
    return (random_word(key_a, key_b, stream, draw) + 0.5) * 2.3283064365386963e-10


@kernel
def normal_quantile(u: float) -> float:
    """Return the standard normal quantile of ``u`` in (0, 1), to 1e-6.

    M. J. Wichura, "Algorithm AS 241: the percentage points of the normal distribution",
    Applied Statistics 37 (1988), the seven-figure variant.
    """
    q = u - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        top = ((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179
        low = ((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0
        return q * top / low
    r = math.sqrt(-log_of_fraction(min(u, 1.0 - u))) - 1.6
    top = ((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777
    low = (0.12021132975 * r + 0.73700164250) * r + 1.0
    value = top / low
    if q < 0.0:
        return -value
    return value


@kernel
def normal(key_a: int, key_b: int, stream: int, draw: int) -> float:
    """Return a standard normal number (32 bits of it: at most 6.3 in size)."""
    return normal_quantile(uniform(key_a, key_b, stream, draw))


SEED_WORDS = (0x243F6A88, 0xB7E15162)
"""Key words before any word of the seed is absorbed."""


@kernel
def absorb(a: int, b: int, word: int) -> tuple[int, int]:
    """Return two key words that depend on a further 32-bit word of the seed."""
    a = mix(a ^ mix(word))
    return a, mix(((b + a) & 0xFFFFFFFF) ^ mix(word ^ 0x5BF03635))


def seed_words(seed: int) -> tuple[int, int]:
    """Return the two 32-bit key words of a non-negative integer seed of any size."""
    if seed < 0:
        raise ValueError(f"seed must be a non-negative integer, got {seed}")
    a, b = SEED_WORDS
    while True:
        a, b = absorb(a, b, seed & 0xFFFFFFFF)
        seed >>= 32
        if not seed:
            return int(a), int(b)
