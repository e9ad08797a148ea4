"""Mutilated files: bytes changed, removed, doubled or inserted at random."""

import random

WORDS = (b"[", b"{", b"&a ", b"*a ", b"!!int ", b"\0", b"9" * 400, b":", b"null", b'""')
MOST_REMOVED, MOST_DOUBLED = 40, 4000


def mutated(data: bytes, draws: random.Random) -> bytes:
    """Return bytes with some of them changed, removed, doubled or inserted."""
    made = bytearray(data)
    for _ in range(draws.randint(1, 4)):
        at, to = sorted(draws.randrange(len(made) + 1) for _ in range(2))
        kind = draws.randrange(4)
        if kind == 0 and at < len(made):
            made[at] = draws.randrange(256)
        elif kind == 1:
            del made[at : min(to, at + MOST_REMOVED)]
        elif kind == 2:
            made[at:at] = made[at : min(to, at + MOST_DOUBLED)] * draws.randint(1, 3)
        else:
            made[at:at] = draws.choice(WORDS)
    return bytes(made)
