"""What stands in all lanes at one place of an array, as one vector of the processor; with one lane, as a plain number.

Kernels are written once, as for one number: ``put(x, i, at(x, i, lanes) + h * at(f, i, lanes), lanes)``. Loops over
lanes would do the same and take half as long again: the compiler cannot know that two arrays do not overlap, and asks
before each of them.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, register_model

from kempf.pipeline.model.batch import MOST

_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, MOST)
#: products may be added without rounding in between, as everywhere in the kernels (`kempf.pipeline.compiled`)
_FUSED = ("contract",)


def _emitted(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate what gives numba the instructions of a function; it takes all arguments but the first."""
    made: Callable[..., Any] = intrinsic(function)
    return made


class _Lanes(types.Type):
    """`MOST` numbers."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes({MOST})")


LANES_TYPE = _Lanes()


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, _VECTOR)


def _spread(builder: Any, number: Any) -> Any:
    """Emit a vector with a number in every lane."""
    first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), MOST), [0] * MOST)
    return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), places)


def _wide(context: Any, builder: Any, value: Any, of: Any) -> Any:
    if isinstance(of, _Lanes):
        return value
    return _spread(builder, context.cast(builder, value, of, types.float64))


def _is_number(of: Any) -> bool:
    return isinstance(of, types.Float | types.Integer)


class _Arithmetic(AbstractTemplate):
    def generic(self, args: Any, _keywords: Any) -> Any:
        if any(isinstance(a, _Lanes) for a in args) and all(isinstance(a, _Lanes) or _is_number(a) for a in args):
            return signature(LANES_TYPE, *args)
        return None


def _lower(operation: Any, build: Callable[..., Any]) -> None:
    infer_global(operation)(type(f"_{operation.__name__}", (_Arithmetic,), {}))

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return build(builder, *(_wide(context, builder, a, of) for a, of in zip(args, sig.args, strict=True)))

    numbers = (types.Float, types.Integer)
    pairs = [(_Lanes, _Lanes), *((_Lanes, number) for number in numbers), *((number, _Lanes) for number in numbers)]
    for kinds in pairs if operation not in (operator.neg, abs) else [(_Lanes,)]:
        lower_builtin(operation, *kinds)(lowered)


for _plain, _in_place, _build in (
    (operator.add, operator.iadd, "fadd"),
    (operator.sub, operator.isub, "fsub"),
    (operator.mul, operator.imul, "fmul"),
    (operator.truediv, operator.itruediv, "fdiv"),
):
    for _operation in (_plain, _in_place):
        _lower(_operation, lambda builder, a, b, build=_build: getattr(builder, build)(a, b, flags=_FUSED))
_lower(operator.neg, lambda builder, a: builder.fneg(a))
_lower(abs, lambda builder, a: _called(builder, "llvm.fabs", a))


def _called(builder: Any, name: str, *args: Any) -> Any:
    """Emit the call of a function of LLVM's for a number, or for a vector of them."""
    of = args[0].type
    kind = "f64" if of is _DOUBLE else f"v{MOST}f64"
    function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(of, [of] * len(args)), f"{name}.{kind}")
    return builder.call(function, args)


def _pointer(context: Any, builder: Any, array_of: Any, array: Any, place_of: Any, place: Any, number_of: Any) -> Any:
    """Address of a place; the lanes lie side by side there, whatever the array is a part of."""
    made = context.make_array(array_of)(context, builder, array)
    strides = cgutils.unpack_tuple(builder, made.strides)
    if isinstance(place_of, types.Integer):
        indices = [context.cast(builder, place, place_of, types.intp)]
    else:
        parts = cgutils.unpack_tuple(builder, place)
        indices = [context.cast(builder, p, of, types.intp) for p, of in zip(parts, place_of, strict=True)]
    assert len(indices) == array_of.ndim - 1
    byte = builder.bitcast(made.data, ir.IntType(8).as_pointer())
    for index, stride in zip(indices, strides, strict=False):
        byte = builder.gep(byte, [builder.mul(index, stride)])
    return builder.bitcast(byte, number_of.as_pointer())


def _number_of(lanes: Any) -> Any:
    return _DOUBLE if len(lanes) == 1 else _VECTOR


@_emitted
def at(_context: Any, array: Any, place: Any, lanes: Any) -> Any:
    """Return what stands in all lanes at a place of an array whose last axis are lanes.

    Parameters
    ----------
    place : int or tuple of int
        Indices of the axes before the last, none of them negative.
    """
    result = types.float64 if len(lanes) == 1 else LANES_TYPE

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        address = _pointer(context, builder, sig.args[0], args[0], sig.args[1], args[1], _number_of(sig.args[2]))
        return builder.load(address, align=8)

    return result(array, place, lanes), build


@_emitted
def everywhere(_context: Any, number: Any, lanes: Any) -> Any:
    """Return a number, the same in all lanes."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = context.cast(builder, args[0], sig.args[0], types.float64)
        return value if len(sig.args[1]) == 1 else _spread(builder, value)

    return (types.float64 if len(lanes) == 1 else LANES_TYPE)(number, lanes), build


@_emitted
def put(_context: Any, array: Any, place: Any, value: Any, lanes: Any) -> Any:
    """Write all lanes at a place of an array; see `at`."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        number = _number_of(sig.args[3])
        address = _pointer(context, builder, sig.args[0], args[0], sig.args[1], args[1], number)
        if number is _VECTOR:
            value = _wide(context, builder, args[2], sig.args[2])
        else:
            value = context.cast(builder, args[2], sig.args[2], types.float64)
        builder.store(value, address, align=8)
        return context.get_dummy_value()

    return types.void(array, place, value, lanes), build


@_emitted
def choose(_context: Any, left: Any, right: Any, yes: Any, no: Any) -> Any:
    """Return ``yes`` where ``left`` <= ``right``, else ``no``, lane by lane."""
    many = any(isinstance(of, _Lanes) for of in (left, right, yes, no))

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        def of(k: int) -> Any:
            if many:
                return _wide(context, builder, args[k], sig.args[k])
            return context.cast(builder, args[k], sig.args[k], types.float64)

        return builder.select(builder.fcmp_ordered("<=", of(0), of(1)), of(2), of(3))

    return (LANES_TYPE if many else types.float64)(left, right, yes, no), build


@_emitted
def root(_context: Any, x: Any) -> Any:
    """Return the square root, lane by lane."""

    def build(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return _called(builder, "llvm.sqrt", args[0])

    return x(x), build


@_emitted
def power(_context: Any, x: Any, exponent: Any) -> Any:
    """Return ``x`` to the power of a number, lane by lane."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        number = context.cast(builder, args[1], sig.args[1], types.float64)
        by = _spread(builder, number) if isinstance(sig.args[0], _Lanes) else number
        return _called(builder, "llvm.pow", args[0], by)

    return x(x, exponent), build
