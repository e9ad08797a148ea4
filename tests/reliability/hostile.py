"""Hostile files, tampered states and drawn actions in bulk, each kind in a process of its own."""

import contextlib
import copy
import dataclasses
import functools
import hashlib
import itertools
import json
import lzma
import os
import random
import resource
import shutil
import signal
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tests.mutation import mutated

SECONDS = 5
WHOLE = 11_000
"""Number of mutated files with which all crafted ones are tried."""
MEMORY = 2**30  # bytes beyond those of the process before
CODE = ("os.system", "subprocess.Popen", "os.exec", "os.posix_spawn", "os.startfile", "os.fork")
"""Audit events of code that a file runs."""
Outcome = str
Act = Callable[[int], Outcome]


class Hang(BaseException):
    """Takes more than ``SECONDS``."""


def _hang(*_: object) -> None:
    raise Hang


def isolated(number: int, act: Act) -> Counter[Outcome]:
    """Call ``act`` with 0, 1, ... in forks; count its outcomes, and crashes, which end a fork."""
    counts: Counter[Outcome] = Counter()
    first = 0
    while first < number:
        reading, writing = os.pipe()
        pid = os.fork()
        if pid == 0:
            try:
                _child(range(first, number), act, writing)
            finally:
                os._exit(0)
        os.close(writing)
        with open(reading, encoding="utf-8") as pipe:
            found = pipe.read().split("\n")[:-1]
        counts.update(found)
        first += len(found)
        if os.waitpid(pid, 0)[1] and first < number:
            counts["crash"] += 1
            first += 1
    return counts


def _child(numbers: range, act: Act, writing: int) -> None:
    signal.signal(signal.SIGPROF, _hang)
    ran: list[str] = []
    sys.addaudithook(lambda event, _: ran.append(event) if event in CODE else None)
    before = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in numbers:
        ran.clear()
        signal.setitimer(signal.ITIMER_PROF, SECONDS)  # of computation
        try:
            outcome = act(number)
        except Hang:
            outcome = "hang"
        except Exception as error:
            outcome = f"traceback {type(error).__name__}"
        signal.setitimer(signal.ITIMER_PROF, 0)
        if ran:
            outcome = "code run"
        if 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before > MEMORY:
            outcome = "memory"
            before += MEMORY
        os.write(writing, f"{outcome}\n".encode())


# --- files ---------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Kind:
    """A kind of file: its reader, good files, and crafted ones."""

    name: str  # of a file
    read: Callable[[Path], Any]
    good: tuple[bytes, ...]
    crafted: tuple[bytes, ...] = ()


def kinds(folder: Path) -> Iterator[Kind]:
    """Yield every kind of file that a stranger may give."""
    from agents.policies.policy import OnnxPolicy
    from agents.settings import presets
    from agents.training import train
    from benchmarks.runs import rows
    from benchmarks.scenarios import scenario
    from tests.agents import short_runs
    from tests.data import test_hostile_files as files

    yaml = tuple(text.encode() for text in files.crafted_yaml())
    for name in (".plant", ".rig", ".csv"):
        good = tuple(text.encode() for text in files.SEEDS[name])
        crafted = yaml if name != ".csv" else tuple(t.encode() for t in files.crafted_csv())
        yield Kind(f"file{name}", files.READERS[name], good, crafted)
    places = sorted(scenario.FOLDER.glob("positioning_*.yaml"))
    yield Kind(
        "positioning_nominal.yaml", scenario.load, tuple(p.read_bytes() for p in places), yaml
    )
    path = presets.preset_path(short_runs.ID, "ppo")
    yield Kind(path.name, presets.read, (path.read_bytes(),), yaml)
    row = rows.path_of("positioning_nominal--inverse")
    yield Kind(f"positioning_nominal/{row.name}", rows.load, (row.read_bytes(),))
    resealed = functools.partial(_read_row, folder / "resealed" / row.parent.name / row.name)
    yield Kind("row.json", resealed, (lzma.decompress(row.read_bytes()),))
    short_runs.trained(folder / "run", short_runs.tiny(steps=256))
    policy, checkpoint = ((folder / "run" / n) for n in ("policy.onnx", "checkpoint.pt"))
    yield Kind("policy.onnx", OnnxPolicy.load, (policy.read_bytes(),))
    head = 8 + 32
    body = checkpoint.read_bytes()[head:]
    yield Kind("checkpoint.pt", functools.partial(_read_checkpoint, train), (body,))


def _read_row(path: Path, given: Path) -> None:
    """Read a mutated row's text with a checksum that fits."""
    from benchmarks.identity.hashing import digest
    from benchmarks.runs import rows, store

    text = given.read_bytes()
    with contextlib.suppress(ValueError, TypeError, AttributeError, RecursionError):
        record = json.loads(text)
        record["checksum"] = digest(store.comparable(record))
        text = json.dumps(record).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(lzma.compress(text, preset=0))
    try:
        rows.load(path)
    except ValueError as error:
        raise ValueError(f"{error} {given.name}") from error


def _read_checkpoint(train: Any, path: Path) -> None:
    """Read a mutated checkpoint with a checksum that fits."""
    from agents.training.checkpoint import MARK

    body = path.read_bytes()
    path.write_bytes(MARK + hashlib.sha256(body).digest() + body)
    train.saved_run(path.parent)


def files(folder: Path, number: int) -> Iterator[tuple[str, int, Counter[Outcome]]]:
    """Yield the outcomes of mutated files of all kinds, and of a share of the crafted ones."""
    every = list(kinds(folder))
    for k, kind in enumerate(every):
        mutants = len(range(k, number, len(every)))
        draws = random.Random(k)
        contents = [mutated(draws.choice(kind.good), draws) for _ in range(mutants)]
        contents += kind.crafted[:: max(1, WHOLE // number)]
        place = folder / "tried" / kind.name
        place.parent.mkdir(parents=True, exist_ok=True)

        def act(i: int, kind: Kind = kind, place: Path = place, of: Any = contents) -> Outcome:
            place.write_bytes(of[i])
            try:
                kind.read(place)
            except ValueError as error:
                text = str(error)
                named = place.name in text and not {"\x1b", "\0"} & set(text)
                return "refused" if named else "no name in the message"
            return "read"

        yield kind.name, len(contents), isolated(len(contents), act)


# --- rows of the board ---------------------------------------------------------------------------


def board(number: int, folder: Path) -> Iterator[tuple[str, int, Counter[Outcome]]]:
    """Yield how boards and sites of rows end of which one was changed and has a new checksum.

    The committed verifications count as those of the folder, so that a row without a new checksum,
    or with an unnoticed change, would be shown as verified.
    """
    from benchmarks.board import accessors, leaderboard, site
    from benchmarks.runs import rows, store, verified

    track = "positioning_nominal"
    shutil.copytree(rows.RESULTS / track, folder / track)
    for path in sorted((folder / track).iterdir())[3:]:
        path.unlink()
    found = verified.committed(rows.RESULTS)
    verified.committed = lambda _: found  # type: ignore[assignment]
    path = rows.files(folder)[0]
    good = store.read_json(path)
    assert all(row[accessors.VERIFIED] for row in leaderboard.load(folder))

    def act(i: int) -> Outcome:
        draws = random.Random(i)
        changed = copy.deepcopy(good)
        while store.comparable(changed) == store.comparable(good):
            alter(changed, draws)
        if draws.random() < 0.9:
            changed = store.seal(changed)
        path.write_bytes(lzma.compress(json.dumps(changed).encode(), preset=0))
        try:
            loaded = leaderboard.load(folder)
            leaderboard.files(loaded)
            site.page(loaded)
        except ValueError as error:
            named = good["controller"]["name"] in str(error)
            return "refused" if named else "no name in the message"
        (row,) = (row for row in loaded if row["row"] == good["row"])
        return "shown as verified" if row[accessors.VERIFIED] else "shown, not as verified"

    yield "rows", number, isolated(number, act)


STRANGE: tuple[Any, ...] = (
    *(None, True, -1, 0, 2**70, 1e300, -1e-300, "", "<b>", "\x1b[1m", "x" * 9999, "../../x"),
    *([], {}, [[]], {"": 0}),
)
"""Values in place of one of a row."""


def alter(record: Any, draws: random.Random) -> None:
    """Change, remove, double or exchange one of the values of nested lists and mappings."""
    held = record
    while True:
        keys = list(held) if isinstance(held, dict) else range(len(held))
        key = draws.choice(list(keys))
        if not isinstance(held[key], (dict, list)) or not held[key] or draws.random() < 0.1:
            break
        held = held[key]
    kind, other = draws.randrange(5), draws.choice(list(keys))
    if kind == 0:
        del held[key]
    elif kind == 1 and isinstance(held, dict):
        held[f"{key}_more"] = held[key]
    elif kind == 1:
        held.append(held[key])
    elif kind == 2:
        held[key], held[other] = held[other], held[key]
    elif kind == 3 and isinstance(held[key], (int, float)):
        held[key] *= draws.choice([1 - 1e-5, 0.5, -1, 1e9])
    else:
        held[key] = draws.choice(STRANGE)


# --- actions, states, checkpoints, cache ---------------------------------------------------------


def actions(number: int) -> Iterator[tuple[str, int, Counter[Outcome]]]:
    """Yield, for each environment, how drawn actions end, alone and in a batch."""
    import gymnasium as gym

    from tests.envs.cases import IDS
    from tests.envs.core.test_actions import action

    each = -(-number // (2 * len(IDS)))
    for name in IDS:
        draws = np.random.default_rng(IDS.index(name))
        makers = (
            lambda name=name: gym.make(name).unwrapped,
            lambda name=name: gym.make_vec(name, 2, vectorization_mode="vector_entry_point"),
        )
        counts: Counter[Outcome] = Counter()
        for make in makers:
            env: Any = make()
            env.reset(seed=0)

            def act(_: int, env: Any = env, draws: Any = draws) -> Outcome:
                drawn, good = action(draws, env.action_space.shape)
                before = env.get_state()
                try:
                    env.step(drawn)
                except ValueError:
                    after = env.get_state()
                    same = all(np.array_equal(after[key], before[key]) for key in before)
                    return "refused" if same and not good else "good, refused"
                return "accepted" if good else "bad, accepted"

            counts += isolated(each, act)
        yield name, 2 * each, counts


def states(number: int, folder: Path) -> Iterator[tuple[str, int, Counter[Outcome]]]:
    """Yield how single changed numbers of states and of checkpoints end, with steps after them.

    Then the same for changes whose author makes a new digest, which only have to crash nothing.
    """
    import gymnasium as gym

    from pam_envs.envs.core.saved_state import sealed
    from tests.agents import short_runs
    from tests.envs.cases import IDS

    each = -(-number // (len(IDS) + 1))
    for name, anew in itertools.product(IDS, (False, True)):
        env: Any = gym.make(name).unwrapped
        env.reset(seed=3)
        env.step(np.zeros(env.action_space.shape))
        state = env.get_state()
        draws = np.random.default_rng(IDS.index(name))

        def act(
            _: int, env: Any = env, state: Any = state, draws: Any = draws, anew: bool = anew
        ) -> Outcome:
            key = str(draws.choice(sorted(key for key in state if state[key].size)))
            changed = state[key].copy()
            place = tuple(int(draws.integers(n)) for n in changed.shape)
            while np.array_equal(changed, state[key], equal_nan=True):
                changed[place] = tampered(changed[place], draws)
            given = {**state, key: changed}
            try:
                env.set_state(sealed(given) if anew else given)
            except ValueError:
                return "refused"
            for _ in range(3):
                env.step(np.zeros(env.action_space.shape))
            return "digest made anew, accepted" if anew else f"changed '{key}' accepted"

        yield f"{name}{', digest made anew' if anew else ''}", each, isolated(each, act)
    short_runs.trained(folder / "trained", short_runs.tiny(steps=256))
    for anew in (False, True):
        name = f"checkpoint.pt{', digest made anew' if anew else ''}"
        yield name, each, checkpoints(each, folder, anew)


def tampered(value: Any, draws: np.random.Generator) -> Any:
    """Return another number of the type of a value, often an extreme one."""
    chosen = draws.choice([1e300, -1e300, 1e9, -1e9, 2.0**40, -3.0, 200.0, np.nan, np.inf])
    kind = np.asarray(value).dtype
    if kind.kind == "f":
        return chosen
    if kind.kind == "b":
        return not value
    bounds = np.iinfo(kind)
    return max(bounds.min, min(bounds.max, int(np.nan_to_num(chosen, posinf=2**62))))


def checkpoints(number: int, folder: Path, anew: bool) -> Counter[Outcome]:
    """Return how checkpoints with one changed number end, with the old checksum or a new one."""
    import torch

    from agents.training import checkpoint, train

    good = (folder / "trained/checkpoint.pt").read_bytes()
    draws = np.random.default_rng(0)
    target = folder / "tampered"
    target.mkdir(exist_ok=True)

    def act(_: int) -> Outcome:
        content = checkpoint.load(folder / "trained/checkpoint.pt")
        leaves = list(_leaves(content["snapshot"]))
        holder, key = leaves[int(draws.integers(len(leaves)))]
        value = holder[key]
        if isinstance(value, torch.Tensor):
            flat = value.reshape(-1).clone()
            place = int(draws.integers(len(flat)))
            while torch.equal(flat, value.reshape(-1)):
                new = torch.tensor(tampered(flat[place].numpy(), draws))
                flat[place] = new.to(value.dtype)
            holder[key] = flat.reshape(value.shape)
        else:
            holder[key] = tampered(value, draws) if isinstance(value, (int, float)) else None
        path = target / "checkpoint.pt"
        checkpoint.save(path, content)
        if not anew:
            head = len(checkpoint.MARK) + 32
            path.write_bytes(good[:head] + path.read_bytes()[head:])
        try:
            model = train.resume(train.saved_run(target))
            model.learn(64, reset_num_timesteps=False)
        except ValueError:  # of learning, where torch finds an action that is not finite
            return "refused"
        return "digest made anew, accepted" if anew else "changed number accepted"

    return isolated(number, act)


def _leaves(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the holders and keys of all numbers and tensors that are not empty."""
    for key, entry in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(entry, (dict, list)):
            yield from _leaves(entry)
        elif entry is not None and getattr(entry, "shape", (1,)) != (0,):
            yield value, key


def cache(number: int, folder: Path) -> Counter[Outcome]:
    """Return how a file of the compile cache with one flipped bit is read."""
    from pam_envs.kernels import cache as code

    path = folder / "code.o"
    code.write_whole(path, np.random.default_rng(0).bytes(20_000))
    good, draws = path.read_bytes(), random.Random(0)
    counts: Counter[Outcome] = Counter()
    for _ in range(number):
        bit = draws.randrange(8 * len(good))
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        path.write_bytes(bad)
        counts["wrong code" if code.read_whole(path) is not None else "refused"] += 1
    return counts
