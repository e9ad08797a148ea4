"""Evaluation of a function block in Structured Text, parsed by blark.

Assignments, IF, arithmetic on LREAL as double precision, and the functions that the exported blocks
call; anything else is an error.
"""

import operator
from collections.abc import Callable
from functools import cache
from typing import Any

from blark import parse, transform

BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    ">": operator.gt,
    "<": operator.lt,
    ">=": operator.ge,
    "<=": operator.le,
}
UNARY: dict[str, Callable[[Any], Any]] = {"NOT": operator.not_, "-": operator.neg}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "MIN": min,
    "MAX": max,
    "LREAL_TO_DINT": round,  # IEC 61131-3: to the nearest, ties to even
    "DINT_TO_LREAL": float,
}


@cache
def _parsed(text: str) -> Any:
    """Return the only function block of a text."""
    parsed = parse.parse_source_code(text)
    if parsed.exception is not None:
        raise ValueError(str(parsed.exception))
    (block,) = parsed.transform().items
    return block


class FunctionBlock:
    """An instance of the only function block of a text."""

    def __init__(self, text: str) -> None:
        self.block = _parsed(text)
        self.values: dict[str, Any] = {}
        self.types: dict[str, str] = {}
        for section in self.block.declarations:
            for item in section.items:
                for declared in item.variables:
                    name = str(declared.variable.name)
                    assert name not in self.values, f"{name} is declared twice"
                    self.types[name] = str(item.init.spec.type)
                    value = item.init.value
                    self.values[name] = None if value is None else self._value(value)

    def __call__(self, **inputs: Any) -> dict[str, Any]:
        """Run the body with inputs; return all variables."""
        for name, value in inputs.items():
            self._set(name, value)
        self._run(self.block.body)
        return self.values

    def _set(self, name: str, value: Any) -> None:
        expected = {"LREAL": float, "BOOL": bool}[self.types[name]]
        assert isinstance(value, expected), f"{name} is {self.types[name]}, not {value!r}"
        self.values[name] = value

    def _run(self, statements: Any) -> None:
        for statement in statements.statements:
            if isinstance(statement, transform.AssignmentStatement):
                (target,) = statement.variables
                self._set(str(target.name), self._value(statement.expression))
            elif isinstance(statement, transform.IfStatement):
                self._branch(statement)
            else:
                raise TypeError(f"a statement of {type(statement).__name__}")

    def _branch(self, statement: Any) -> None:
        if self._value(statement.if_expression):
            self._run(statement.statements)
            return
        for clause in statement.else_ifs:
            if self._value(clause.if_expression):
                self._run(clause.statements)
                return
        if statement.else_clause is not None:
            self._run(statement.else_clause.statements)

    def _value(self, node: Any) -> Any:
        if isinstance(node, transform.Real):
            return float(str(node.value))
        if isinstance(node, transform.Boolean):
            return str(node.value).upper() == "TRUE"
        if isinstance(node, transform.SimpleVariable):
            value = self.values[str(node.name)]
            assert value is not None, f"{node.name} is read before it is set"
            return value
        if isinstance(node, transform.UnaryOperation):
            return UNARY[str(node.op).upper()](self._value(node.expr))
        if isinstance(node, transform.BinaryOperation):
            return BINARY[str(node.op)](self._value(node.left), self._value(node.right))
        if isinstance(node, transform.ParenthesizedExpression):
            return self._value(node.expr)
        if isinstance(node, transform.FunctionCall):
            values = [self._value(parameter.value) for parameter in node.parameters]
            return FUNCTIONS[str(node.name.name)](*values)
        raise TypeError(f"an expression of {type(node).__name__}")
