"""Structured Text (IEC 61131-3) of the muscle's PID and of the polynomials of positioning2021.

One function block for each controller, to be called once in a control period. Inputs and output are
in SI, whatever the scale of the environment's signals.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

from baselines.core.controller import LOAD_DIGITS
from baselines.linear.pid import Pid
from baselines.positioning.contraction_tables import polynomial
from baselines.positioning.pid import MuscleView
from baselines.positioning.table_inverse import DEAD_BAND, TwoBranch
from pam_envs.constants import BAR, MM
from pam_envs.parameters import Signals


def function_block(name: str, controller: Any, signals: Signals, actions: Signals) -> str:
    """Return the function block of a controller.

    Raises
    ------
    ValueError
        If the controller is neither a PID of the muscle nor one with polynomials.
    """
    title = "FB_" + "".join(word.capitalize() for word in name.split("_"))
    low, high = actions[0].low, actions[0].high
    if isinstance(controller, Pid) and isinstance(controller.view, MuscleView):
        return _pid(title, controller, low, high)
    if isinstance(controller, TwoBranch):
        branches = [branch for load in controller.curves.curves for branch in load]
        if all(isinstance(c, partial) and c.func is polynomial for c in branches):
            return _polynomials(title, controller, low, high)
    raise ValueError(
        f"{name} cannot be written in Structured Text; these can: pid, plc_as_printed, "
        "plc_refitted, one_cubic"
    )


def number(value: float) -> str:
    """Return a literal of type LREAL, to the last bit."""
    mantissa, _, exponent = repr(float(value)).partition("e")
    if "." not in mantissa:
        mantissa += ".0"
    return mantissa + (f"E{exponent}" if exponent else "")


Declared = Sequence[tuple[str, str, str]]
"""Name, type with initial value, and comment of variables."""


def _block(
    title: str, summary: str, inputs: Declared, own: Declared, constants: Declared, body: str
) -> str:
    def section(head: str, variables: Declared) -> str:
        lines = "\n".join(f"    {n} : {kind}; (* {why} *)" for n, kind, why in variables)
        return f"{head}\n{lines}\nEND_VAR\n"

    output = [("PressureSetPoint", "LREAL", "Pa: for the regulator")]
    first = [("Restart", "BOOL", "TRUE in the first call of an episode"), *inputs]
    return (
        f"(* {summary}\n   Call once in a control period. All quantities are SI. *)\n"
        f"FUNCTION_BLOCK {title}\n"
        + section("VAR_INPUT", first)
        + section("VAR_OUTPUT", output)
        + section("VAR", own)
        + section("VAR CONSTANT", constants)
        + f"\n{body}\nEND_FUNCTION_BLOCK\n"
    )


def _pid(title: str, controller: Pid, low: float, high: float) -> str:
    gains, view = controller.gains, controller.view
    assert isinstance(view, MuscleView)
    constants = [
        ("Proportional", gains.proportional, "Pa/m"),
        ("IntegralGain", gains.integral, "Pa/(m s)"),
        ("Derivative", gains.derivative, "Pa s/m, on the measurement"),
        ("FilterTime", gains.filter_time, "s, of the derivative"),
        ("TrackingTime", gains.tracking_time, "s, of the back-calculation"),
        ("Period", controller.period, "s: control period"),
        ("Reach", view.reach, "Pa: largest distance from the measured pressure"),
        ("Lowest", low, "Pa"),
        ("Highest", high, "Pa"),
    ]
    body = """IF Restart THEN
    Integral := SetPoint;
    LastContraction := Contraction;
    Slope := 0.0;
END_IF;
Low := MAX(Pressure - Reach, Lowest);
High := MIN(Pressure + Reach, Highest);
Error := DesiredContraction - Contraction;
Pole := FilterTime / (FilterTime + Period);
Slope := Pole * Slope + (1.0 - Pole) * (Contraction - LastContraction) / Period;
Unlimited := Proportional * Error + Integral - Derivative * Slope;
Output := MIN(MAX(Unlimited, Low), High);
Back := (Output - Unlimited) * MIN(1.0, Period / TrackingTime);
Integral := MIN(MAX(Integral + IntegralGain * Period * Error + Back, Low), High);
LastContraction := Contraction;
PressureSetPoint := MIN(MAX(Output, Lowest), Highest);"""
    words = "Integral LastContraction Slope Low High Error Pole Unlimited Output Back"
    return _block(
        title,
        "PID of the contraction, SIMC tuning, with limited integral.",
        [
            ("Contraction", "LREAL", "m, measured"),
            ("Pressure", "LREAL", "Pa, measured"),
            ("SetPoint", "LREAL", "Pa: setpoint of the last period"),
            ("DesiredContraction", "LREAL", "m"),
        ],
        [(word, "LREAL := 0.0", "state" if k < 3 else "scratch") for k, word in
         enumerate(words.split())],
        [(n, f"LREAL := {number(v)}", why) for n, v, why in constants],
        body,
    )  # fmt: skip


def _polynomials(title: str, controller: TwoBranch, low: float, high: float) -> str:
    loads, curves = controller.curves.loads, controller.curves.curves
    scale = 10.0**LOAD_DIGITS
    cases = []
    for k, (up, down) in enumerate(curves):
        sides = [_horner(*branch.args) for branch in (up, down) if isinstance(branch, partial)]
        cases.append(
            f"(* {loads[k]:g} kg *)\nIF Inflating THEN\n{sides[0]}\nELSE\n{sides[1]}\nEND_IF;\n"
            f"P{k} := P;"
        )
    spans = []
    for k in range(len(loads) - 1):
        share = f"(Payload - {number(loads[k])}) / {number(loads[k + 1] - loads[k])}"
        word = "IF" if k == 0 else "ELSIF"
        last = k == len(loads) - 2
        head = "ELSE" if last and k else f"{word} Payload <= {number(loads[k + 1])} THEN"
        spans.append(
            f"{head}\n    Share := {share};\n    P := (1.0 - Share) * P{k} + Share * P{k + 1};"
        )
    body = f"""IF Restart THEN
    Inflating := DesiredContraction >= Contraction;
    Extremum := DesiredContraction;
END_IF;
(* the branch changes when the reference has reversed by more than the dead band *)
IF Inflating THEN
    Reversal := Extremum - DesiredContraction;
ELSE
    Reversal := DesiredContraction - Extremum;
END_IF;
IF Reversal > DeadBand THEN
    Inflating := NOT Inflating;
    Extremum := DesiredContraction;
ELSIF Reversal < 0.0 THEN
    Extremum := DesiredContraction;
END_IF;
Target := DesiredContraction / {number(MM)}; (* mm *)
{chr(10).join(cases)}
(* between the loads of the tables *)
Payload := DINT_TO_LREAL(LREAL_TO_DINT(Load * {number(scale)})) / {number(scale)};
Payload := MIN(MAX(Payload, {number(loads[0])}), {number(loads[-1])});
{chr(10).join(spans)}
END_IF;
PressureSetPoint := MIN(MAX({number(BAR)} * P, {number(low)}), {number(high)});"""
    scratch = ["Reversal", "Target", "X", "P", "Payload", "Share"]
    scratch += [f"P{k}" for k in range(len(loads))]
    return _block(
        title,
        "Pressure as polynomials of the contraction, for each load and direction "
        "(positioning2021).",
        [
            ("Contraction", "LREAL", "m, measured; read at the start of an episode"),
            ("Load", "LREAL", "kg"),
            ("DesiredContraction", "LREAL", "m"),
        ],
        [
            ("Inflating", "BOOL := TRUE", "state: direction"),
            ("Extremum", "LREAL := 0.0", "state: extremum of the reference, m"),
            *((word, "LREAL := 0.0", "scratch") for word in scratch),
        ],
        [("DeadBand", f"LREAL := {number(DEAD_BAND)}", "m")],
        body,
    )


def _horner(coefficients: Any, span: Any) -> str:
    """Return statements that set P [bar] to a polynomial of Target [mm], held within a span."""
    lowest, highest = map(float, span)
    x = "Target"
    if lowest > -float("inf"):
        x = f"MIN(MAX(Target, {number(lowest)}), {number(highest)})"
    first, *rest = map(float, coefficients)
    lines = [f"    X := {x};", f"    P := {number(first)};"]
    lines += [f"    P := P * X + {_signed(value)};" for value in rest]
    return "\n".join(lines)


def _signed(value: float) -> str:
    return number(value) if value >= 0.0 else f"({number(value)})"
