"""A robot's arrays by one pointer: what the compiled functions pass on to each other.

A NamedTuple of forty arrays as an argument is two hundred numbers, put on the stack and read back in every call, or, where the
callee is expanded, in every loop. `pinned` puts them down once and gives a pointer to them, with the same fields: functions take
either. The fields are fixed from then on, so that the compiler need not read one again after it has written a number.
"""

from __future__ import annotations

from typing import Any, TypeVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import lower_builtin, lower_getattr_generic, models, register_model, type_callable

_T = TypeVar("_T")


def pinned(fields: _T) -> _T:
    """The same fields by a pointer, good until the function that calls this returns."""
    return fields


class _Pinned(types.Type):
    def __init__(self, fields: Any) -> None:
        self.of = fields
        super().__init__(name=f"pinned.{fields.instance_class.__name__}.{hash(fields) & 0xFFFFFF:x}")

    @property
    def key(self) -> Any:
        return self.of


@register_model(_Pinned)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, manager.lookup(kind.of).get_data_type().as_pointer())


@type_callable(pinned)
def _type(context: Any) -> Any:
    return lambda fields: _Pinned(fields) if isinstance(fields, types.NamedTuple) else fields


@lower_builtin(pinned, types.NamedTuple)
def _(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    model = context.data_model_manager.lookup(sig.args[0])
    place = cgutils.alloca_once(builder, model.get_data_type())
    builder.store(model.as_data(builder, args[0]), place)
    # the compiler must not look through the pointer, or it would take what was here before for what is always here
    return builder.asm(ir.FunctionType(place.type, [place.type]), "", "=r,0,~{memory}", [place], side_effect=True)


@lower_builtin(pinned, _Pinned)
def _(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return args[0]


@infer_getattr
class _Fields(AttributeTemplate):
    key = _Pinned

    def generic_resolve(self, pinned: Any, name: str) -> Any:
        if name not in pinned.of.fields:
            return None
        kind = pinned.of.types[pinned.of.fields.index(name)]
        return _Pinned(kind) if isinstance(kind, types.NamedTuple) else kind


@lower_getattr_generic(_Pinned)
def _(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    index = kind.of.fields.index(name)
    place = cgutils.gep_inbounds(builder, value, 0, index)
    of = kind.of.types[index]
    if isinstance(of, types.NamedTuple):
        return place
    fixed = lambda pointer: _fixed(builder, pointer)
    if not isinstance(of, types.Array):
        return context.data_model_manager.lookup(of).from_data(builder, fixed(place))
    out = ir.Constant(context.get_value_type(of), ir.Undefined)
    for k, member in enumerate(context.data_model_manager.lookup(of)._members):
        at = cgutils.gep_inbounds(builder, place, 0, k)
        if isinstance(member, ir.ArrayType):
            parts = ir.Constant(member, ir.Undefined)
            for j in range(member.count):
                parts = builder.insert_value(parts, fixed(cgutils.gep_inbounds(builder, at, 0, j)), j)
            out = builder.insert_value(out, parts, k)
        else:
            out = builder.insert_value(out, fixed(at), k)
    return out


def _fixed(builder: Any, pointer: Any) -> Any:
    """What is there, and stays."""
    value = builder.load(pointer)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value
