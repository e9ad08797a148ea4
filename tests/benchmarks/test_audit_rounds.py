"""Audit rounds: one salt a track, drawn after all artefacts, of no use to who tries many."""

from __future__ import annotations

import hashlib
import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import bench_fakes
import numpy as np
import pytest
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from agents.policies.policy import OnnxPolicy
from agents.policies.residual import ResidualPolicy
from baselines.core import tuned
from baselines.trivial import Constant
from benchmarks.__main__ import main
from benchmarks.identity import artefacts, audit, tasks
from benchmarks.identity.hashing import digest
from benchmarks.identity.source_code import needed
from benchmarks.identity.verify import verify
from benchmarks.runs import controllers, provenance, rows
from benchmarks.runs.controllers import Entrant, find
from benchmarks.runs.store import comparable, read_record, write_record
from benchmarks.scenarios import scenario as scenarios
from tests.benchmarks.row_helpers import commit, draw, git, place, run_row, tiny


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Path]:
    with place(tmp_path) as folder:
        yield folder


def a_round(**changes: object) -> audit.Round:
    """Return a round of two controllers."""
    given = {
        "track": "tiny",
        "number": 1,
        "task": "task",
        "entrants": {"low": "a", "high": "b"},
        "salt": "salt",
        "drawn": "2026-01-01",
        "commit": "c" * 40,
    }
    return audit.Round(**{**given, **changes})


def test_seeds_follow_from_task_entrants_salt_scenario_and_number() -> None:
    everybody = hashlib.sha256(b'{"high":"b","low":"a"}').hexdigest()
    text = f"task|{everybody}|salt|steps|3".encode()
    first = int.from_bytes(hashlib.sha256(text).digest()[:8], "big")
    assert a_round().seeds(["steps", "sines"])["steps"][3] == first >> 11 < 2**53
    found = {a_round().seeds(["steps"])["steps"][0], a_round().seeds(["sines"])["sines"][0]}
    changed = ({"task": "other"}, {"salt": "other"}, {"entrants": {"low": "a", "high": "c"}})
    found |= {a_round(**change).seeds(["steps"])["steps"][0] for change in changed}
    assert len(found) == 5


@pytest.mark.parametrize(("scenarios", "each"), [(1, 30), (2, 15), (8, 4), (30, 2), (40, 2)])
def test_there_are_thirty_audit_episodes_and_two_of_each_scenario(
    scenarios: int, each: int
) -> None:
    seeds = a_round().seeds([f"{k}" for k in range(scenarios)])
    assert {len(found) for found in seeds.values()} == {each}
    assert sum(map(len, seeds.values())) >= 30
    assert len({seed for found in seeds.values() for seed in found}) == scenarios * each


def test_a_round_is_drawn_once_and_all_of_it_run_the_same_episodes(board: Path) -> None:
    reported = rows.load(run_row(board, "trained"))
    assert reported["audit"] is None
    assert not audit.in_last_round(reported)
    drawn = draw(board, "trained", "integral")
    assert draw(board, "trained", "integral") == drawn == audit.last("tiny")
    assert audit.rounds() == [drawn]
    assert (drawn.number, drawn.task) == (1, tasks.task_digest(tiny(board)))
    seeds = drawn.seeds([scenario.name for scenario in tiny(board).scenarios()])
    wanted = [(name, seed) for name, own in seeds.items() for seed in own]
    for name, runs in (("trained", (0, 1)), ("integral", (None,))):
        row = rows.load(run_row(board, name))
        assert audit.in_last_round(row)
        assert {k: row["audit"][k] for k in ("round", "salt", "drawn", "commit", "entry")} == {
            "round": 1,
            "salt": drawn.salt,
            "drawn": drawn.drawn,
            "commit": drawn.commit,
            "entry": 1,
        }
        assert {k: tuple(own) for k, own in row["audit"]["seeds"].items()} == seeds
        episodes = rows.episodes_of(row, "audit")
        for run in runs:
            mine = [(e["scenario"], e["seed"]) for e in episodes if e["training_seed"] == run]
            assert mine == wanted
        scores = row["audit"]["aggregate"]["rms_error"]
        assert scores["mean"] == pytest.approx(rows.scores_of(episodes, "rms_error").mean())
        gap = scores["mean"] - row["aggregate"]["rms_error"]["mean"]
        assert row["audit"]["gap"]["rms_error"] == gap != 0.0
    assert row["aggregate"] != reported["aggregate"]


def test_the_command_draws_runs_and_tells(
    board: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("trained", "low")
    chosen = {name: entry for name, entry in bench_fakes.CONTROLLERS.items() if name in names}
    monkeypatch.setattr(bench_fakes, "CONTROLLERS", chosen)
    folders = ["--out", str(board / "out"), "--cells", str(board / "cells"), "--jobs", "1"]
    assert main(["audit", "tiny", *folders]) == 0
    (drawn,) = audit.rounds()
    said = capsys.readouterr().out
    assert f"tiny: round 1, 2 controllers, salt {drawn.salt} of {drawn.drawn}" in said
    assert "; audit " in said
    before = lasting(board / "out")
    assert set(before) == {"tiny--trained", "tiny--low"}
    assert main(["audit", "--all", *folders]) == 0
    assert "0 cells computed" in capsys.readouterr().out
    assert lasting(board / "out") == before
    assert audit.rounds() == [drawn]
    for given in (["short"], [], ["tiny", "--all"]):
        assert main(["audit", *given, *folders]) == 2
    assert "name tracks, or give --all" in capsys.readouterr().err


def lasting(folder: Path) -> dict[str, object]:
    """Return what is compared of the rows of a folder."""
    return {rows.name_of(path): comparable(read_record(path)) for path in rows.files(folder)}


def test_what_has_changed_reports_itself_until_the_next_round(board: Path) -> None:
    first = draw(board, "trained", "low")
    old = rows.load(run_row(board, "low"))
    bench_fakes.write_policies(board / "policies", 0.02, 0.06)
    assert audit.find(find("trained"), tiny(board)) is None
    with pytest.raises(ValueError, match=r"not as in the last commit: trained\.s1\.json; commit"):
        draw(board, "trained", "low")
    commit(board)
    second = draw(board, "trained", "low")
    assert (first.number, second.number) == (1, 2)
    names = [scenario.name for scenario in tiny(board).scenarios()]
    assert not set(first.seeds(names).values()) & set(second.seeds(names).values())
    entries = [audit.find(find(name), tiny(board)) for name in ("trained", "low")]
    assert [found.entry for found in entries if found] == [2, 1]
    assert not audit.in_last_round(old)  # its artefact is the same, its episodes are not
    assert audit.in_last_round(rows.load(run_row(board, "low")))
    assert draw(board, "low").number == 3  # one that is gone is a change, too


def test_a_changed_task_needs_a_round(board: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw(board, "low")
    monkeypatch.setattr(tasks, "scoring_digest", lambda groups: "another rule")
    assert audit.find(find("low"), tiny(board)) is None
    assert draw(board, "low").number == 2


def test_what_git_does_not_know_gets_no_salt(board: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bench_fakes.write_policies(board / "policies", 0.02, 0.05, 0.08)
    with pytest.raises(ValueError, match=r"trained\.s2\.json"):
        draw(board, "trained")
    git(board, "add", "--all")  # known, and not committed
    with pytest.raises(ValueError, match=r"trained\.s2\.json"):
        draw(board, "trained")
    commit(board)
    task = board / "tiny.yaml"
    task.write_text(task.read_text() + "# another\n")
    with pytest.raises(ValueError, match=r"tiny\.yaml"):
        draw(board, "trained")
    git(board, "checkout", "--", "tiny.yaml")
    monkeypatch.setattr(provenance, "changed", lambda: ["pam_envs/kernels/build.py"])
    with pytest.raises(ValueError, match=r"tiny: not as in the last commit: pam_envs/kernels\.py"):
        draw(board, "trained")
    assert audit.rounds() == []


def test_outside_of_a_checkout_there_is_no_salt(
    board: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path_factory.mktemp("no checkout")
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(elsewhere.parent))
    bench_fakes.write_policies(elsewhere, 0.02)
    monkeypatch.setattr(bench_fakes, "POLICIES", elsewhere)
    with pytest.raises(ValueError, match="not in a git checkout"):
        draw(board, "trained")


def test_two_that_draw_at_once_draw_one_after_the_other(
    board: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lock = audit.FILE.with_name(f".{audit.FILE.name}.lock")
    monkeypatch.setattr(audit, "FileLock", lambda path: FileLock(path, timeout=0.1))
    with FileLock(lock), pytest.raises(Timeout):
        draw(board, "low")
    assert draw(board, "low").number == 1


def test_the_files_of_a_classical_controller_are_its_code(board: Path) -> None:
    entrant, track = find("integral"), tiny(board)
    assert artefacts.files_of(entrant, track) == {Path(bench_fakes.__file__).resolve()}
    integral, inverse = (artefacts.of(find(name), track) for name in ("integral", "inverse"))
    assert integral.digest != inverse.digest
    assert integral.code == inverse.code


def test_the_code_that_answers_for_a_policy_is_of_its_artefact(
    board: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entrant, track = find("trained"), tiny(board)
    before = artefacts.of(entrant, track)
    assert Path(bench_fakes.__file__).resolve() in artefacts.files_of(entrant, track)
    monkeypatch.setattr(artefacts, "_code_digest", lambda files, root: "another")
    artefacts._built.cache_clear()
    after = artefacts.of(entrant, track)
    assert after.files == before.files
    assert after.code != before.code
    assert after.digest != before.digest


def test_knobs_that_a_search_found_are_of_the_artefact() -> None:
    found = tuned.read()
    for name, entrant in controllers.available().items():
        assert dict(entrant.knobs) == (found[entrant.tuned].knobs if entrant.tuned else {})
        if entrant.kind == "classical":
            assert entrant.tuned == (name if name in found else "")
    some = Constant((), ())
    plain = Entrant("zero", "", "nothing", "", (), "classical", "baselines.core.catalogue")
    codes = {
        artefacts.controller_code(replace(plain, knobs=knobs), some)
        for knobs in ((), (("lead", 1.0),), (("lead", 1.0 + 1e-15),))
    }
    assert len(codes) == 3


NEEDED = {"policy.py", "residual.py", "catalogue.py", "controllers.py", "policy_file.py"}


@pytest.mark.parametrize("kind", ["learned", "residual"])
def test_a_policy_needs_the_agents_that_answer_and_the_controller_that_it_corrects(
    kind: str,
) -> None:
    entrant = Entrant(
        "any", "", "nothing", "", (), kind, "agents.policies.catalogue", ((0, Path("any")),)
    )
    policy = OnnxPolicy.__new__(OnnxPolicy)
    learned = policy if kind == "learned" else ResidualPolicy(policy, Constant((), ()))
    found = [needed(*part) for part in artefacts.code_files(entrant, learned)]
    names = [{file.relative_to(controllers.ROOT).as_posix() for file in part} for part in found]
    assert {f"agents/{name}" for name in NEEDED} < names[0]
    assert all(name.startswith("agents/") for name in names[0])
    assert [part for part in names[1:] if "baselines/trivial.py" in part] == names[1:]
    assert len(names) == 1 + (kind == "residual")


def test_rounds_are_only_ever_added(board: Path) -> None:
    draw(board, "trained")
    audit.check_only_added()
    commit(board)
    (kept,) = json.loads(audit.FILE.read_text())["rounds"]
    for changed in ([], [{**kept, "salt": "0" * 32}]):
        audit.FILE.write_text(json.dumps({"rounds": changed}))
        with pytest.raises(ValueError, match="were changed; restore it from git"):
            audit.check_only_added()
    with pytest.raises(ValueError, match="were changed"):
        draw(board, "trained", "low")
    audit.FILE.write_text(json.dumps({"rounds": [kept, kept]}))
    with pytest.raises(ValueError, match="round 1 of tiny stands where round 2 has to be"):
        audit.rounds()
    audit.FILE.write_text(json.dumps({"rounds": [{"salt": "0"}]}))
    with pytest.raises(ValueError, match="not a list of rounds"):
        audit.rounds()


# A controller that is designed when it is built, from a file of its package, holds other last
# digits on another processor.

CATALOGUE = '''
"""Scale 1.00"""
import json
from pathlib import Path
from bench_fakes import Entry, Inverse
CONTROLLERS = {"designed": Entry("as a file says", "nominal model")}
HERE = Path(__file__).parent
DIGITS = 1.0
def make_controller(name, plant=None, signals=None, action_signals=None, seed=0):
    gain = json.loads((HERE / "gain.txt").read_text()) * float(__doc__.split()[-1])
    return Inverse(plant, signals, action_signals, gain=gain * DIGITS)
'''


@dataclass
class Designs:
    """A package that designs a controller, in a checkout of rounds."""

    board: Path
    patch: pytest.MonkeyPatch

    @property
    def folder(self) -> Path:
        """Where the package lies."""
        return self.board / "designs_of_tests"

    def entrant(self) -> Entrant:
        """Return the controller."""
        return find("designed")

    def go_to(self, digits: float, cpu: str) -> None:
        """Go to another machine."""
        self.patch.setattr(self.module, "DIGITS", digits)
        self.patch.setattr(provenance, "cpu", lambda: cpu)
        artefacts._built.cache_clear()

    def reload(self) -> None:
        """Import the package as it is now."""
        sys.modules.pop("designs_of_tests.catalogue", None)
        self.module = importlib.import_module("designs_of_tests.catalogue")
        for cache in (artefacts._built, artefacts._needed, artefacts._code_digest):
            cache.cache_clear()


@pytest.fixture
def designs(board: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Designs]:
    made = Designs(board, monkeypatch)
    made.folder.mkdir()
    (board / ".gitignore").write_text("__pycache__\nout\ncells\n")
    (made.folder / "__init__.py").write_text("")
    (made.folder / "catalogue.py").write_text(CATALOGUE)
    (made.folder / "gain.txt").write_text("0.02")
    commit(board)
    monkeypatch.syspath_prepend(board)
    source = ("designs_of_tests.catalogue", "designs_of_tests", "classical")
    monkeypatch.setattr(controllers, "SOURCES", (*controllers.SOURCES, source))
    made.reload()
    made.go_to(1.0, "one")
    yield made
    for name in ("designs_of_tests", "designs_of_tests.catalogue"):
        sys.modules.pop(name, None)
    artefacts._built.cache_clear()


def test_what_is_designed_on_another_machine_is_in_its_round(board: Path, designs: Designs) -> None:
    drawn, track = draw(board, "designed", "low"), tiny(board)
    here = run_row(board, "designed", out=board / "out" / "here")
    designs.go_to(1.0 + 1e-12, "another")
    assert artefacts.of(designs.entrant(), track).digest != drawn.entrants["designed"]
    found = audit.find(designs.entrant(), track)
    assert found is not None
    assert found.artefact == drawn.entrants["designed"]
    assert draw(board, "designed", "low") == drawn
    there = run_row(board, "designed", out=board / "out" / "there", cells=board / "cells" / "anew")
    row = rows.load(there)
    assert row["audit"]["seeds"] == rows.load(here)["audit"]["seeds"]
    assert row["audit"]["artefact"] == drawn.entrants["designed"]
    assert audit.in_last_round(row)
    assert audit.artefact_of(row) == audit.artefact_of(rows.load(here))  # one identity to cite
    assert not audit.in_last_round({**row, "audit": {**row["audit"], "artefact": "another"}})
    for path, mode in ((there, "bits"), (here, "elsewhere")):
        verdict = verify(path, compare="either")
        assert (verdict.drifted, verdict.mode) == ([], mode)
    designs.go_to(1.0, "one")
    verdict = verify(there, compare="either")
    assert (verdict.drifted, verdict.mode) == ([], "elsewhere")
    assert not verify(there).holds


CHANGES = {
    "data": ("gain.txt", "0.025"),
    "docstring": ("catalogue.py", CATALOGUE.replace("1.00", "1.25")),
    "another page": ("more.py", "A = 1"),
}


@pytest.mark.parametrize("committed", [False, True])
@pytest.mark.parametrize("what", CHANGES)
def test_on_no_machine_a_design_may_be_changed_after_the_salt(
    what: str, committed: bool, board: Path, designs: Designs
) -> None:
    """Also if the row says the old digests: what else makes it, git tells."""
    drawn, track = draw(board, "designed"), tiny(board)
    commit(board)
    honest = read_record(run_row(board, "designed"))
    name, text = CHANGES[what]
    (designs.folder / name).write_text(text)
    if committed:
        commit(board)
    designs.reload()
    designs.go_to(1.0 + 1e-12, "another")
    assert audit.find(designs.entrant(), track) is None
    assert name in audit.history(drawn, designs.entrant(), track).wrong[0]
    path = run_row(board, "designed", out=board / "out" / "after")
    row = read_record(path)
    assert row["audit"] is None
    row = {**honest, "made_with": {**row["made_with"], "cpu": "anything"}}
    write_record(path, row)
    for compare in ("bits", "either", "elsewhere"):
        verdict = verify(path, compare=compare)
        assert any(f"has another designs_of_tests/{name}" in line for line in verdict.drifted)


def test_where_git_cannot_say_a_design_is_in_no_round(
    board: Path, designs: Designs, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw(board, "designed")
    designs.go_to(1.0 + 1e-12, "another")
    assert audit.find(designs.entrant(), tiny(board)) is not None

    def absent(*_: object, **__: object) -> None:
        raise FileNotFoundError("git")

    monkeypatch.setattr(subprocess, "run", absent)
    assert audit.find(designs.entrant(), tiny(board)) is None
    designs.go_to(1.0, "one")
    assert audit.find(designs.entrant(), tiny(board)) is not None  # its digest says it


def test_a_policy_is_designed_by_none() -> None:
    entrant = Entrant(
        "any", "", "nothing", "", (), "learned", "agents.policies.catalogue", ((0, Path("any")),)
    )
    assert audit._designer(entrant) is None
    corrects = audit._designer(replace(entrant, kind="residual"))
    assert corrects == controllers.ROOT / "baselines"


def recorded(board: Path, **changes: str) -> list[str]:
    """Return what ``verify`` finds once the round of a row that was run was altered."""
    content = json.loads(audit.FILE.read_text())
    content["rounds"][0] |= changes
    audit.FILE.write_text(json.dumps(content))
    return verify(run_row(board, "trained")).drifted


def test_the_commit_of_a_round_has_to_be_there_and_before(board: Path) -> None:
    draw(board, "trained")
    assert recorded(board) == []
    (wrong,) = recorded(board, commit="0" * 40)
    assert wrong == "audit.commit: 000000000000 is none of the present commit's past"
    git(board, "checkout", "--quiet", "-b", "aside")
    git(board, "commit", "--quiet", "--allow-empty", "--message", "aside")
    aside = head(board)
    git(board, "checkout", "--quiet", "-")
    (wrong,) = recorded(board, commit=aside)
    assert "is none of the present commit's past" in wrong


def test_the_commit_of_a_round_has_to_hold_the_artefact(board: Path) -> None:
    first = head(board)
    bench_fakes.write_policies(board / "policies", 0.02, 0.05, 0.08)
    commit(board)
    draw(board, "trained")
    assert recorded(board) == []
    (wrong,) = recorded(board, commit=first)
    assert wrong == f"audit.commit: {first[:12]} has another trained.s2.json"


def test_the_commit_of_a_round_has_to_hold_the_code_that_answers_and_that_scores(
    board: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers, scores = board / "answers.py", board / "scores.py"
    answers.write_text("filtered = False\n")
    commit(board)
    drawn, entrant, track = draw(board, "trained"), find("trained"), tiny(board)
    monkeypatch.setattr(artefacts, "files_of", lambda *_: frozenset({answers}))
    monkeypatch.setattr(tasks, "files_of", lambda _: frozenset({scores}))
    scores.write_text("worst = 1.0\n")
    commit(board)

    def wrong() -> list[str]:
        return [line.rpartition(" ")[2] for line in audit.history(drawn, entrant, track).wrong]

    assert wrong() == ["scores.py"]  # the round's commit does not have it at all
    monkeypatch.setattr(tasks, "files_of", lambda _: frozenset())
    answers.write_text("# told\nfiltered = False\n")
    assert wrong() == []
    answers.write_text("filtered = True\n")
    assert wrong() == ["answers.py"]
    commit(board)
    assert wrong() == ["answers.py"]


def head(folder: Path) -> str:
    """Return the present commit."""
    return provenance.git("rev-parse", "HEAD", folder=folder)


def test_where_git_cannot_say_a_note_does(
    board: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw(board, "trained")
    commit(board)
    commit(board)
    path = run_row(board, "trained")
    shallow = tmp_path_factory.mktemp("shallow") / "clone"
    git(board, "clone", "--quiet", "--depth", "1", board.as_uri(), str(shallow))
    monkeypatch.setattr(audit, "FILE", shallow / "rounds.json")
    verdict = verify(path)
    assert verdict.holds, verdict.drifted
    assert any("this clone is shallow" in note for note in verdict.notes)

    def absent(*_: object, **__: object) -> None:
        raise FileNotFoundError("git")

    monkeypatch.setattr(subprocess, "run", absent)
    verdict = verify(path)
    assert verdict.holds, verdict.drifted
    assert any("this is no git checkout" in note for note in verdict.notes)


# A task of one number: a table of answers, given blindly, to what a seed draws. None can do better
# than by its size, but on known seeds one of a thousand does.
VARIANTS, STEPS, SIZE = 1000, 12, 0.5
PUBLIC = range(101, 106)
TASK = digest("a tiny task")
SCENARIOS = ("calm", "windy")
DRAWN = np.random.default_rng(3).normal(size=(9973, STEPS))


def disturbances(scenario: str, seeds: tuple[int, ...]) -> NDArray[np.float64]:
    """Return what the seeds of a scenario draw, shape (seeds, steps)."""
    return DRAWN[[(seed + len(scenario)) % len(DRAWN) for seed in seeds]]


def score(table: NDArray[np.float64], seeds: dict[str, tuple[int, ...]]) -> float:
    """Return the mean RMS over scenarios and seeds of what a table of answers leaves."""
    left = [disturbances(name, found) + table for name, found in seeds.items()]
    return float(np.mean([np.sqrt(np.mean(part**2, axis=-1)).mean() for part in left]))


def variants() -> NDArray[np.float64]:
    """Return a thousand artefacts that are equally good, shape (variants, steps)."""
    drawn = np.random.default_rng(7).normal(size=(VARIANTS, STEPS))
    return SIZE * drawn / np.sqrt(np.mean(drawn**2, axis=-1, keepdims=True))


def ground(tables: NDArray[np.float64], known: list[dict[str, tuple[int, ...]]]) -> int:
    """Return the variant with the lowest score on the seeds that its maker can know."""
    return int(np.argmin([score(table, seeds) for table, seeds in zip(tables, known, strict=True)]))


def audit_seeds(table: NDArray[np.float64], salt: str) -> dict[str, tuple[int, ...]]:
    entrants = {"ground": digest(table), "rival": "r" * 64}
    return a_round(task=TASK, entrants=entrants, salt=salt).seeds(SCENARIOS)


def test_grinding_a_thousand_variants_gains_nothing() -> None:
    tables = variants()
    public = dict.fromkeys(SCENARIOS, tuple(PUBLIC))
    best = ground(tables, [public] * VARIANTS)
    claimed = score(tables[best], public)
    level = np.mean([score(table, public) for table in tables])
    assert claimed < 0.93 * level  # on the public seeds it pays

    # each salt gives every variant audit seeds of its own
    salts = [f"{k:032x}" for k in range(40)]
    audited = [score(tables[best], audit_seeds(tables[best], salt)) for salt in salts]
    others = [score(table, audit_seeds(table, salts[0])) for table in tables]
    scatter = np.std(audited) / np.sqrt(len(salts)) + np.std(others) / np.sqrt(VARIANTS)
    assert abs(np.mean(audited) - np.mean(others)) < 3.0 * scatter
    assert np.mean(audited) - claimed > 0.8 * (np.mean(others) - claimed) > 0.0
    assert min(audited) > claimed


def test_without_a_salt_to_come_grinding_would_pay() -> None:
    tables, guess, drawn = variants(), "", "5" * 32
    best = ground(tables, [audit_seeds(table, guess) for table in tables])
    known = score(tables[best], audit_seeds(tables[best], guess))
    blind = score(tables[best], audit_seeds(tables[best], drawn))
    level = np.mean([score(table, audit_seeds(table, drawn)) for table in tables])
    assert known < 0.9 * level
    assert abs(blind - level) < 3.0 * np.std(
        [score(table, audit_seeds(table, drawn)) for table in tables]
    )
    assert blind > known


def test_tracks_have_names_that_a_seed_can_be_derived_from() -> None:
    tracks = scenarios.available().values()
    assert not [s.name for track in tracks for s in track.scenarios() if "|" in s.name]
