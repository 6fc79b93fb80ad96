"""Four numbers side by side: what the inner loops add and multiply at once.

A `lanes` value is one vector register (two on a processor with short ones) for four neighbours in an array: modes of a link or of
a robot, points along a link, columns of a small matrix. The compiler cannot find these by itself, for two arrays might overlap.
Arrays that are read so end on a multiple of WIDTH, with zeros after their own values (`padded`). Arithmetic with +, -, *, /
works on lanes and on lanes with a number. Every function here is plain Python on arrays of four too: what the compiled one does.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from itertools import accumulate
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model, type_callable

WIDTH = 4
_LINE = 8  # numbers on a cache line
_I32, _I64, _F64 = ir.IntType(32), ir.IntType(64), ir.DoubleType()
_VECTOR, _MASK = ir.VectorType(_F64, WIDTH), ir.VectorType(ir.IntType(1), WIDTH)
_NONE = ir.Constant(_VECTOR, ir.Undefined)


def padded(count: int) -> int:
    """The next multiple of WIDTH."""
    return -(-count // WIDTH) * WIDTH


class _Plain(np.ndarray):
    """Four numbers in plain Python: a value, as a float is, which += replaces and does not change."""

    __iadd__, __isub__, __imul__ = np.ndarray.__add__, np.ndarray.__sub__, np.ndarray.__mul__  # type: ignore[assignment]


def _plain(values: Any) -> Any:
    return np.array(values, dtype=float).view(_Plain)


def room(**shapes: int | tuple[int, ...]) -> dict[str, np.ndarray]:
    """Zeros of these shapes in one piece of memory, each beginning on a cache line, so that four neighbours never lie on two of
    them where rows are `padded`; four may be read or written from the last place of each."""
    counts = [shape if isinstance(shape, int) else math.prod(shape) for shape in shapes.values()]
    starts = list(accumulate([-(-(count + WIDTH) // _LINE) * _LINE for count in counts], initial=0))
    memory = np.zeros(starts[-1] + _LINE)
    first = -memory.ctypes.data % 64 // 8
    return {
        name: memory[first + start : first + start + count].reshape(shape)
        for (name, shape), start, count in zip(shapes.items(), starts, counts, strict=False)
    }


def load(a: np.ndarray, k: int) -> Any:
    """a[k : k + 4]; where a ends before that, of which `room` takes care, the rest is anything."""
    return load_some(a, k, min(WIDTH, len(a) - k))


def load_some(a: np.ndarray, k: int, count: int) -> Any:
    """The first `count` of a[k : k + 4], zeros after them; what lies beyond is not read."""
    count = max(0, min(count, WIDTH))
    return _plain([*a[k : k + count], *[0.0] * (WIDTH - count)])


def store(a: np.ndarray, k: int, x: Any) -> None:
    """a[k : k + 4] = x; where a ends before that, what follows in its `room` is overwritten."""
    store_some(a, k, x, min(WIDTH, len(a) - k))


def store_some(a: np.ndarray, k: int, x: Any, count: int) -> None:
    """The first `count` of x to a[k : k + 4]; what lies beyond is not touched."""
    count = max(0, min(count, WIDTH))
    a[k : k + count] = x[:count]


def lanes(x: float) -> Any:
    """x in every lane."""
    return _plain([x] * WIDTH)


def pack(a: float, b: float, c: float, d: float) -> Any:
    return _plain([a, b, c, d])


def parts(x: Any) -> tuple[float, float, float, float]:
    return x[0], x[1], x[2], x[3]


def total(x: Any) -> float:
    return (x[0] + x[2]) + (x[1] + x[3])


def running(x: Any) -> Any:
    """x0, x0 + x1, ..., the sum of all four."""
    x = x + _plain([0.0, *x[:-1]])
    return x + _plain([0.0, 0.0, *x[:-2]])


def root(x: Any) -> Any:
    return np.sqrt(x)


def nearest(x: Any) -> Any:
    """Whole numbers, halves to even ones."""
    return np.rint(x).view(_Plain)


def turned(a: Any, b: Any, c: Any, d: Any) -> tuple[Any, Any, Any, Any]:
    """The columns of the rows a, b, c, d."""
    return tuple(_plain(column) for column in zip(a, b, c, d, strict=True))  # type: ignore[return-value]


class _Lanes(types.Type):
    def __init__(self) -> None:
        super().__init__(name="lanes")


_lanes = _Lanes()


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _function(python: Callable[..., Any], result: Any, *arguments: Any) -> Callable[[Any], None]:
    """The compiled form of a function of this module: its types, and what builds it."""
    typer = eval(f"lambda context: lambda {', '.join('abcde'[: len(arguments)])}: result", {"result": result})
    type_callable(python)(typer)

    def built(build: Any) -> None:
        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            given = []
            for value, kind, wanted in zip(args, sig.args, arguments, strict=True):
                if wanted is types.Array:
                    assert kind.ndim == 1 and kind.layout == "C", f"{python.__name__}: neighbours must lie side by side"
                    value = context.make_array(kind)(context, builder, value).data
                elif kind != wanted:
                    value = context.cast(builder, value, kind, wanted)
                given.append(value)
            out = build(context, builder, *given)
            return context.get_dummy_value() if out is None else out

        lower_builtin(python, *(types.Any if kind not in (types.Array, _lanes) else kind for kind in arguments))(lower)

    return built


def _shuffled(builder: Any, x: Any, y: Any, *order: int) -> Any:
    return builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(_I32, len(order)), list(order)))


def _spread(builder: Any, x: Any) -> Any:
    return _shuffled(builder, builder.insert_element(_NONE, x, _I32(0)), _NONE, 0, 0, 0, 0)


def _at(builder: Any, data: Any, k: Any) -> Any:
    return builder.bitcast(builder.gep(data, [k]), _VECTOR.as_pointer())


def _first(builder: Any, count: Any) -> Any:
    """The mask of the first `count` lanes."""
    integers = ir.VectorType(_I64, WIDTH)
    none = ir.Constant(integers, ir.Undefined)
    wide = _shuffled(builder, builder.insert_element(none, count, _I32(0)), none, 0, 0, 0, 0)
    return builder.icmp_signed("<", ir.Constant(integers, list(range(WIDTH))), wide)


def _masked(builder: Any, name: str, result: Any, *args: Any) -> Any:
    kind = ir.FunctionType(result, [a.type for a in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.masked.{name}.v{WIDTH}f64.p0"), args)


@_function(load, _lanes, types.Array, types.intp)
def _(context: Any, builder: Any, data: Any, k: Any) -> Any:
    return builder.load(_at(builder, data, k), align=8)


@_function(load_some, _lanes, types.Array, types.intp, types.intp)
def _(context: Any, builder: Any, data: Any, k: Any, count: Any) -> Any:
    zero = ir.Constant(_VECTOR, [0.0] * WIDTH)
    return _masked(builder, "load", _VECTOR, _at(builder, data, k), _I32(8), _first(builder, count), zero)


@_function(store, types.void, types.Array, types.intp, _lanes)
def _(context: Any, builder: Any, data: Any, k: Any, x: Any) -> None:
    builder.store(x, _at(builder, data, k), align=8)


@_function(store_some, types.void, types.Array, types.intp, _lanes, types.intp)
def _(context: Any, builder: Any, data: Any, k: Any, x: Any, count: Any) -> None:
    _masked(builder, "store", ir.VoidType(), x, _at(builder, data, k), _I32(8), _first(builder, count))


@_function(lanes, _lanes, types.float64)
def _(context: Any, builder: Any, x: Any) -> Any:
    return _spread(builder, x)


@_function(pack, _lanes, *[types.float64] * 4)
def _(context: Any, builder: Any, *args: Any) -> Any:
    out = _NONE
    for k, x in enumerate(args):
        out = builder.insert_element(out, x, _I32(k))
    return out


@_function(parts, types.UniTuple(types.float64, 4), _lanes)
def _(context: Any, builder: Any, x: Any) -> Any:
    return cgutils.pack_array(builder, [builder.extract_element(x, _I32(k)) for k in range(WIDTH)])


@_function(total, types.float64, _lanes)
def _(context: Any, builder: Any, x: Any) -> Any:
    half = builder.fadd(_shuffled(builder, x, _NONE, 0, 1), _shuffled(builder, x, _NONE, 2, 3))
    return builder.fadd(builder.extract_element(half, _I32(0)), builder.extract_element(half, _I32(1)))


@_function(running, _lanes, _lanes)
def _(context: Any, builder: Any, x: Any) -> Any:
    zero = ir.Constant(_VECTOR, [0.0] * WIDTH)
    x = builder.fadd(x, _shuffled(builder, x, zero, 4, 0, 1, 2))
    return builder.fadd(x, _shuffled(builder, x, zero, 4, 5, 0, 1))


@_function(root, _lanes, _lanes)
def _(context: Any, builder: Any, x: Any) -> Any:
    kind = ir.FunctionType(_VECTOR, [_VECTOR])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.sqrt.v{WIDTH}f64"), [x])


@_function(nearest, _lanes, _lanes)
def _(context: Any, builder: Any, x: Any) -> Any:
    kind = ir.FunctionType(_VECTOR, [_VECTOR])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.rint.v{WIDTH}f64"), [x])


@_function(turned, types.UniTuple(_lanes, 4), *[_lanes] * 4)
def _(context: Any, builder: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    ab, AB = _shuffled(builder, a, b, 0, 4, 2, 6), _shuffled(builder, a, b, 1, 5, 3, 7)
    cd, CD = _shuffled(builder, c, d, 0, 4, 2, 6), _shuffled(builder, c, d, 1, 5, 3, 7)
    pairs = [(ab, cd, 0), (AB, CD, 0), (ab, cd, 2), (AB, CD, 2)]
    return cgutils.pack_array(builder, [_shuffled(builder, x, y, k, k + 1, 4 + k, 5 + k) for x, y, k in pairs])


def _operator(key: Any, name: str) -> None:
    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            numbers = (types.Float, types.Integer)
            if len(args) == 2 and _lanes in args and all(a == _lanes or isinstance(a, numbers) for a in args):
                return signature(_lanes, *args)
            return None

    Template.key = key
    infer_global(key)(Template)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        wide = [
            x if kind == _lanes else _spread(builder, context.cast(builder, x, kind, types.float64))
            for x, kind in zip(args, sig.args, strict=True)
        ]
        return getattr(builder, name)(*wide)

    for other in (types.Float, types.Integer):
        lower_builtin(key, _lanes, other)(lower)
        lower_builtin(key, other, _lanes)(lower)
    lower_builtin(key, _lanes, _lanes)(lower)


for _usual, _inplace, _name in (
    (operator.add, operator.iadd, "fadd"), (operator.sub, operator.isub, "fsub"),
    (operator.mul, operator.imul, "fmul"), (operator.truediv, operator.itruediv, "fdiv"),
):  # fmt: skip
    _operator(_usual, _name)
    _operator(_inplace, _name)


class _Negative(AbstractTemplate):
    key = operator.neg

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(_lanes, _lanes) if args == (_lanes,) else None


infer_global(operator.neg)(_Negative)


@lower_builtin(operator.neg, _lanes)
def _(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])
