"""Forgeries of rows, rounds and verifications, each with the test that makes it."""

REFUSED, OPEN = "refused", "holds, as SECURITY.md says"
RUNS = "tests/benchmarks/runs"
VERIFY, ROWS, STORE = (f"{RUNS}/test_{name}.py::test_" for name in ("verify", "rows", "store"))
ENTRY, NOT_A_ROW = f"{VERIFY}forged_entry_is_detected", f"{ROWS}row_that_is_incomplete_or_misnamed"
ELSEWHERE = f"{VERIFY}forgery_beyond_rounding_is_detected_on_another_machine"
HOSTILE = f"{STORE}hostile_file_is_one_sentence_with_its_name"
CONFINED = (
    "tests/baselines/core/test_isolated_controllers.py::test_confined_controller_reaches_nothing"
)

FORGERIES: tuple[tuple[str, str, str], ...] = (
    ("score lower by 1e-12", REFUSED, f"{ENTRY}[score]"),
    ("score of an audit episode", REFUSED, f"{ENTRY}[audit score]"),
    ("less model knowledge", REFUSED, f"{ENTRY}[knowledge]"),
    ("hash of another policy", REFUSED, f"{ENTRY}[policy hash]"),
    ("digest of another plant", REFUSED, f"{ENTRY}[plants]"),
    ("failed episode left out", REFUSED, f"{ENTRY}[dropped failure]"),
    ("good episode in place of another", REFUSED, f"{ENTRY}[repeated episode]"),
    ("chosen salt", REFUSED, f"{ENTRY}[salt]"),
    ("audit left out", REFUSED, f"{ENTRY}[no audit]"),
    ("better curve", REFUSED, f"{ENTRY}[picture]"),
    ("row of another controller", REFUSED, f"{VERIFY}row_of_another_controller_is_detected"),
    ("easier scenarios", REFUSED, f"{VERIFY}scenarios_of_another_version_are_not_run"),
    ("other environment", REFUSED, f"{VERIFY}row_of_another_environment_version_is_refused"),
    ("missing entries", REFUSED, f"{VERIFY}missing_entries_are_named"),
    ("audit without a round", REFUSED, f"{VERIFY}audit_without_a_round_is_detected"),
    ("score of an invented processor", REFUSED, f"{ELSEWHERE}[episode]"),
    ("failure of an invented processor", REFUSED, f"{ELSEWHERE}[failure]"),
    ("episode left out, invented processor", REFUSED, f"{ELSEWHERE}[dropped]"),
    ("fewer trials, invented processor", REFUSED, f"{ELSEWHERE}[tuning]"),
    ("path in a name", REFUSED, f"{NOT_A_ROW}_is_refused[path in the row's name]"),
    ("metric of one's own", REFUSED, f"{NOT_A_ROW}_is_refused[another metric]"),
    ("entry of one's own", REFUSED, f"{NOT_A_ROW}_is_refused[another entry]"),
    ("text in place of a commit", REFUSED, f"{NOT_A_ROW}_is_refused[other commit]"),
    ("long text among the volatile entries", REFUSED, f"{NOT_A_ROW}_is_refused[long text]"),
    ("control characters in a text", REFUSED, f"{NOT_A_ROW}_is_refused[control characters]"),
    ("key twice", REFUSED, f"{HOSTILE}[.json.xz-twice]"),
    ("40 kB of opening brackets", REFUSED, f"{HOSTILE}[.json.xz-deep]"),
    ("score lower by 9e-6 of it", OPEN, f"{VERIFY}row_of_another_commit_may_differ_by_rounding"),
    (
        "digest of a trajectory, other processor",
        OPEN,
        f"{VERIFY}row_is_reproduced_within_tolerance_on_another_machine",
    ),
    (
        "verification written by hand",
        REFUSED,
        "tests/benchmarks/board/test_leaderboard.py::"
        "test_verification_counts_only_for_the_row_with_its_checksum",
    ),
    (
        "past salt changed and committed",
        REFUSED,
        "tests/benchmarks/identity/test_audit_rounds.py::"
        "test_changed_round_is_found_even_if_it_is_committed",
    ),
    ("controller that patches the scoring", REFUSED, CONFINED),
    ("controller that reads the salts", REFUSED, CONFINED),
)
