"""Page of the head-to-head benchmark, from its rows."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.diagnosis.markdown import table

Row = dict[str, Any]

LOSS = "friction.force"
TEMPLATE = Path(__file__).with_suffix(".md")
MISSING = "**`mujoco.sysid` was not installed: its side was not run.**\n\n"


def page(result: Row) -> str:
    """Return the page of a result of :func:`benchmarks.head_to_head.run.main`."""
    rows = result["rows"]
    against = any("sysid" in row for row in rows)
    packages = ", ".join(f"{k} {v}" for k, v in sorted(result["packages"].items()) if v)
    return TEMPLATE.read_text(encoding="utf-8").format(
        missing="" if against else MISSING,
        noticed=noticed(rows, against),
        parameters=parameters(rows, against),
        transfer=transfer(rows, against),
        others=others(rows, against),
        rule=result["rule"],
        packages=packages,
    )


def rate(hits: Sequence[bool]) -> str:
    """Return a count with its exact 95 % interval."""
    k, n = int(sum(hits)), len(hits)
    bounds = binomtest(k, n).proportion_ci(0.95)
    return f"{k}/{n} ({100 * bounds.low:.0f} to {100 * bounds.high:.0f} %)"


def middle(values: Sequence[float], digits: int = 2) -> str:
    """Return the median and the range."""
    low, mid, high = np.quantile(values, [0.0, 0.5, 1.0])
    return f"{mid:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def flagged(row: Row) -> bool:
    """Return whether our diagnosis reports a model error."""
    return row["ours"]["verdict"] in ("named", "ambiguous", "unexplained")


def named(row: Row) -> bool:
    """Return whether our diagnosis names exactly the hidden cause."""
    right = [row["effect"]] if row["effect"] else []
    verdict = "named" if right else "adequate"
    return bool(row["ours"]["verdict"] == verdict and row["ours"]["causes"] == right)


def by_friction(rows: Sequence[Row]) -> dict[float, list[Row]]:
    """Return the rows with dry friction or without a hidden effect, by friction [N]."""
    levels = sorted({r["hidden"]["friction"] for r in rows if "friction" in r["hidden"]})
    return {f: [r for r in rows if r["hidden"].get("friction") == f] for f in levels}


def noticed(rows: Sequence[Row], against: bool) -> str:
    """Return the table of detections by friction."""
    head = ["friction N", "ours: flagged", "ours: correct name only", "verdicts"]
    head += ["ours: residual before", "after"]
    if against:
        head += ["sysid: issues", "sysid: residual"]
        head += ["with friction: issues", "with friction: residual"]
    made = []
    for friction, some in by_friction(rows).items():
        counts = Counter(r["ours"]["verdict"] for r in some)
        line = [f"{friction:g}", rate([flagged(r) for r in some]), rate([named(r) for r in some])]
        line += [", ".join(f"{v} {n}" for v, n in counts.most_common())]
        line += [middle([r["ours"]["held_out"][k] for r in some]) for k in (0, 1)]
        for tool in ("sysid", "sysid_told") if against else ():
            its = [r[tool] for r in some if tool in r]
            line += [rate([bool(r["issues"]) for r in its]), middle([r["residual"] for r in its])]
        made.append(line)
    return table(head, made) + (
        "\nCounts with exact 95 % intervals. At 0 N the correct answer is *adequate*, no cause. "
        "Residuals are RMS errors over the noise, median and range: ours on held-out blocks, those "
        "of sysid on its training data. At 0 N the issue of sysid with friction is that the "
        "friction is at its lower bound, which is correct. Our residual is well above 1 if the "
        "candidate breaks away slightly early or late and rests elsewhere until the next motion: "
        "with the constants of the rig it was 0.2 to 2.3 mm off on six rigs at 2 N.\n"
    )


def parameters(rows: Sequence[Row], against: bool) -> str:
    """Return the errors of the fitted parameters by friction."""
    tools = {"sysid": ("sysid", "values"), "sysid with friction": ("sysid_told", "values")}
    tools = tools if against else {}
    tools |= {"ours, refitted": ("ours", "base_values"), "ours, extended": ("ours", "values")}
    head = ["friction N", "tool", "mass %", "stiffness %", "damping %", "friction found N"]
    head += ["truth in all of its intervals"] if against else []
    made = []
    for friction, some in by_friction(rows).items():
        for tool, (key, part) in tools.items():
            its = [r for r in some if key in r]
            line = [f"{friction:g}", tool]
            for name in ("mass", "stiffness", "damping"):
                off = [100.0 * (r[key][part][name] / r["rig"][name] - 1.0) for r in its]
                line.append(middle(off, 1))
            found = [r[key][part][LOSS] for r in its if LOSS in r[key][part]]
            line.append(middle(found, 3) if found else "")
            if against:
                line.append(rate([_inside(r, key) for r in its]) if "sysid" in key else "")
            made.append(line)
    note = "\nRelative errors (fitted over true value, minus 1): median and range.\n"
    return table(head, made) + note


def _inside(row: Row, tool: str) -> bool:
    """Return whether all intervals of a tool contain the truth."""
    truth = row["rig"] | {"friction.force": row["rig"]["friction"]}
    found = row[tool]
    return all(abs(found["values"][n] - truth[n]) <= found["intervals"][n] for n in found["values"])


def transfer(rows: Sequence[Row], against: bool) -> str:
    """Return the errors on another experiment by friction."""
    head = ["friction N", "ours, refitted", "ours, extended"]
    head += ["sysid", "sysid with friction"] if against else []
    made = []
    for friction, some in by_friction(rows).items():
        line = [f"{friction:g}", *(middle([r["ours"]["another"][k] for r in some]) for k in (0, 1))]
        if against:
            for tool in ("sysid", "sysid_told"):
                line += [middle([r[tool]["another"] for r in some if tool in r])]
        made.append(line)
    return (
        table(head, made) + "\nRMS error in mm relative to the noise-free rig: median and range.\n"
    )


def others(rows: Sequence[Row], against: bool) -> str:
    """Return the verdicts on other hidden effects."""
    effects = list(dict.fromkeys(r["effect"] for r in rows if "friction" not in r["hidden"]))
    if not effects:
        return "None were run.\n"
    head = ["hidden", "ours: correct name only", "ours: verdicts", "ours: residual before", "after"]
    head += ["sysid: issues", "sysid: residual"] if against else []
    made = []
    for effect in effects:
        some = [r for r in rows if r["effect"] == effect]
        said = Counter(f"{r['ours']['verdict']}: {'+'.join(r['ours']['causes'])}" for r in some)
        line = [f"`{effect}`", rate([named(r) for r in some])]
        line += [", ".join(f"{what} {n}" for what, n in said.most_common())]
        line += [middle([r["ours"]["held_out"][k] for r in some]) for k in (0, 1)]
        if against:
            line += [rate([bool(r["sysid"]["issues"]) for r in some])]
            line += [middle([r["sysid"]["residual"] for r in some])]
        made.append(line)
    return (
        table(head, made)
        + "\nThe effects are 30 ms of dead time, 3 mm of bias, and 6 mm of drift in 60 s.\n"
    )
