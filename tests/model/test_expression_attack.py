"""What reaches for Python through a formula gets an answer in words, at once, and nothing of it is run."""

from __future__ import annotations

import builtins
import contextlib
import json
import time
import warnings
from collections.abc import Callable

import pytest

from kempf.pipeline.model.terms.expression import compiled, names_in
from kempf.pipeline.model.terms.own import from_expression, from_file
from kempf.schemas.errors import UsageError

VARIABLES = {"v": 0, "r": 1, "V": 2}
DEEP = 1000
ATTACKS = {
    "import": "__import__('os').system('true')",
    "dunder name": "__builtins__",
    "dunder attribute": "v.__class__",
    "long way round": "().__class__.__bases__[0].__subclasses__()",
    "attribute": "v.real",
    "attribute call": "v.conjugate()",
    "number attribute": "1 .real",
    "number attribute without blank": "1..real",
    "lambda": "(lambda: 1)()",
    "lambda alone": "lambda v: v",
    "subscript": "v[0]",
    "slice": "v[0:1]",
    "list": "[v, r]",
    "list comprehension": "[x for x in (1, 2)]",
    "generator": "max(x for x in v)",
    "dictionary": "{1: 2}",
    "set": "{v}",
    "tuple": "v, r",
    "empty tuple": "()",
    "f-string": "f'{v}'",
    "string": "'v'",
    "bytes": "b'v'",
    "string times": "'v'*9",
    "walrus": "(v := 3)",
    "assignment": "v = 3",
    "statement": "import os",
    "two statements": "v; r",
    "print": "print(v)",
    "eval": "eval(v)",
    "exec": "exec(v)",
    "open": "open(v)",
    "getattr": "getattr(v, r)",
    "keyword argument": "abs(x=v)",
    "starred": "max(*v)",
    "double starred": "max(**v)",
    "no argument": "abs()",
    "too many arguments": "abs(v, r)",
    "too few arguments": "min(v)",
    "call of a call": "abs(v)(r)",
    "call of a variable": "v(r)",
    "call of a number": "2(3)",
    "function as a value": "abs",
    "function as an argument": "abs(abs)",
    "if": "v if r else 1",
    "if stuck to a number": "1if v else 2",
    "and": "v and r",
    "or": "v or r",
    "not": "not v",
    "comparison": "v < r",
    "equality": "v == r",
    "is": "v is r",
    "in": "v in r",
    "floor division": "v // r",
    "modulo": "v % r",
    "matrix product": "v @ r",
    "bitwise": "v | r",
    "xor": "v ^ r",
    "shift": "1 << 99",
    "invert": "~v",
    "inverted exponent": "v**~2",
    "tower of powers": "9**9**9",
    "large power": "v**99",
    "power of a variable": "v**r",
    "power of a sum": "v**(1 + 1)",
    "infinity by overflow": "1e999",
    "infinity by name": "inf",
    "not a number": "nan",
    "huge integer": "9" * 3000,
    "complex": "1j",
    "hexadecimal": "0x10",
    "octal": "0o7",
    "underscore in a number": "1_000",
    "letter behind a number": "2v",
    "true": "True",
    "none": "None",
    "ellipsis": "...",
    "await": "await v",
    "yield": "yield v",
    "yield in parentheses": "(yield)",
    "comment": "v # r",
    "line continuation": "v \\\n + r",
    "null byte": "v\x00",
    "backspace": "v\x08",
    "escape": "\x1b[2J",
    "wide letter that Python takes for v": "\uff56",
    "cyrillic letter that looks like r": "v*\u0433",
    "greek alpha": "\u03b1",
    "arabic digit": "\u0663",
    "superscript": "v\u00b2",
    "minus sign of print": "v \u2212 r",
    "right to left": "v\u202e + r",
    "no-break space": "v\u00a0+ r",
    "lone surrogate": "v + \ud800",
    "decorator": "@v",
    "backtick": "`v`",
    "dollar": "$v",
    "question mark": "v?",
    "shell": "$(true)",
    "template": "{{v}}",
    "percent format": "%s",
    "semicolon in parentheses": "(v; r)",
    "colon": "v: r",
    "closing too early": "v) + (r",
    "not closed": "(v",
    "empty": "",
    "blank": "   ",
    "very long": "v + " * 100_000 + "v",
    "long name": "v" * 3999,
    "deep parentheses": "(" * DEEP + "v" + ")" * DEEP,
    "only parentheses": "(" * 3999,
    "deep minus": "-" * 3998 + "v",
    "deep sum": "v" + "+v" * 1999,
    "deep plus": "+" * 300 + "v",
    "deep power": "**".join(["2"] * 1000),
    "deep functions": "abs(" * 50 + "v" + ")" * 49,
    "deeper than the stack": "v+(" * 40 + "v" + ")" * 40,
}


@pytest.fixture(autouse=True)
def nothing_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever runs, compiles or opens anything while a formula is read fails the test."""

    def forbidden(*_: object, **__: object) -> None:
        raise AssertionError("a formula was run")

    for name in ("eval", "exec", "open", "print", "input"):
        monkeypatch.setattr(builtins, name, forbidden)


def quickest(refused: Callable[[], object]) -> float:
    """Least of three times, s: the collector of garbage may come in between."""
    times = []
    for _ in range(3):
        begun = time.process_time()
        with contextlib.suppress(UsageError):
            refused()
        times.append(time.process_time() - begun)
    return min(times)


@pytest.mark.parametrize("text", ATTACKS.values(), ids=list(ATTACKS))
def test_it_is_refused_in_words_and_at_once(text: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UsageError) as caught:
            compiled(text, VARIABLES)
        assert quickest(lambda: compiled(text, VARIABLES)) < 0.05
    assert caught.value.code == "expression_invalid"
    assert caught.value.message.startswith("The expression ")
    assert len(caught.value.message) < 700
    assert caught.value.next_step


@pytest.mark.parametrize("text", ATTACKS.values(), ids=list(ATTACKS))
def test_as_an_effect_of_ones_own_it_is_refused_too(text: str) -> None:
    with pytest.raises(UsageError):
        from_expression([f"yaw: {text}"])
    assert quickest(lambda: from_expression([f"yaw: {text}"])) < 0.05


@pytest.mark.parametrize("text", ATTACKS.values(), ids=list(ATTACKS))
def test_in_an_effect_file_it_is_refused_too(text: str) -> None:
    with pytest.raises(UsageError) as caught:
        from_file(
            "name: x\nplain: x\nreference: x\nparameters: {c: {low: -1, high: 1, steps: [0.1]}}\n"
            f"terms: {{yaw: {json.dumps(text)}}}\n",
            "x.yaml",
        )
    assert caught.value.code == "effect_file_invalid"


@pytest.mark.parametrize("text", [None, 3, 2.5, b"v", ["v"], {"v": 1}])
def test_what_is_no_text_is_refused(text: object) -> None:
    with pytest.raises(UsageError):
        names_in(text)  # type: ignore[arg-type]
    with pytest.raises(UsageError):
        from_expression([text])  # type: ignore[list-item]
