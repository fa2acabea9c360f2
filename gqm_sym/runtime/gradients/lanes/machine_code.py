"""Programs as machine code: straight-line code for eight orbits at once, in place of an interpreter.

The results have the same bits as those of the interpreters. These carry out sines and other functions, for all orbits
of a batch at a time, because a function of eight orbits alone would wait for the latencies of its operations. LLVM
takes some tenths of a second for a program, which many launches are worth.
"""

from collections import defaultdict
from collections.abc import Callable, Container, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding, ir
from numpy.typing import NDArray

from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.emitted import MachineCode
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, INTERPRETER, LOW, ROW
from gqm_sym.runtime.gradients.lanes import interpreter as in_lanes
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram
from gqm_sym.runtime.gradients.lanes.interpreter import LANES_INTERPRETER
from gqm_sym.runtime.gradients.lanes.operations import ERROR_BOUND, RESULTS
from gqm_sym.runtime.gradients.lanes.vectors import (
    DOUBLE_OPERATIONS,
    PAIR_OPERATIONS,
    REAL,
    WHOLE,
    WIDTH,
    BodyArguments,
    DoubleBody,
    PairBody,
)
from gqm_sym.runtime.gradients.programs import Program


class CodedProgram(NamedTuple):
    """A program with machine code for it.

    Attributes
    ----------
    operands : tuple
        The operands of the program, with the addresses of this code in place of the interpreters'.
    codes : tuple of MachineCode
        The code, which is removed from memory with this object, so that who runs it keeps the object.
    """

    operands: tuple[Any, ...]
    codes: tuple[MachineCode, ...]


def coded(program: Program | LaneProgram) -> CodedProgram:
    """Return a program with machine code for it."""
    if isinstance(program, Program):
        results = {position: {0, LOW, ERROR} for position in program.outputs.tolist()}
        code = of_pairs(program.operations, program.first, results)
        return CodedProgram((code.address, *program.operands[1:]), (code,))
    stored = defaultdict[int, set[int]](set)
    for kind, _, left, right in [*program.nodes.tolist(), *program.noise.tolist()]:
        if kind == ERROR_BOUND:
            stored[left].add(ERROR)
        elif kind > ERROR_BOUND:
            stored[right] |= {0, LOW}
    codes = (
        of_pairs(program.before, len(program.before), stored),
        of_doubles(program.nodes, program.outputs),
        of_doubles(program.noise, program.variances),
    )
    return CodedProgram((tuple(code.address for code in codes), *program.operands[1:]), codes)


class _Call(NamedTuple):
    """An operation that an interpreter carries out for all orbits.

    Attributes
    ----------
    address : int
        The memory cell with the address of the interpreter.
    operation : (1, 4) array of int
        The operation.
    in_scratch : bool
        Whether its registers are in the memory for numbers that later loops need, instead of the work space.
    """

    address: int
    operation: NDArray[np.int64]
    in_scratch: bool


_Step = _Call | Callable[[BodyArguments], None]
"""One of the steps of a program: a call, or what writes the inside of a loop over orbits."""


def _in_turn(
    rows: Iterable[Sequence[int]], simple: Container[int]
) -> list[tuple[list[Sequence[int]], list[Sequence[int]]]]:
    """Return operations in turns: simple ones, and then others that an interpreter carries out.

    The latter take little time for each orbit if there are many, so that there are few turns. Every register is filled
    once; the results of an operation with several are in registers with consecutive negative numbers.
    """
    turns, turn_of = list[tuple[list[Sequence[int]], list[Sequence[int]]]](), dict[int, int]()
    for row in rows:
        code, out, *operands = row
        turn, is_simple = max(turn_of.get(operand, 0) for operand in operands), code in simple
        while turn >= len(turns):
            turns.append(([], []))
        turns[turn][0 if is_simple else 1].append(row)
        step, after = -1 if out < 0 else ROW, turn if is_simple else turn + 1
        turn_of.update({out + step * k: after for k in range(RESULTS.get(code, 1))})
    return turns


def of_pairs(codes: NDArray[np.int64], cut: int, stored: dict[int, set[int]]) -> MachineCode:
    """Return the machine code of a program in double-double arithmetic.

    Parameters
    ----------
    codes : (m, 4) array of int
        The operations.
    cut : int
        The only number of operations, besides none and all, at which callers begin or end.
    stored : dict
        The positions of the registers that are needed afterwards, each with the rows (0, LOW, ERROR) that are.
    """
    parts = [codes[:cut].tolist(), codes[cut:].tolist()]
    later = {position for row in parts[1] for position in row[2:]}
    everything = {position: {0, LOW, ERROR} for position in later} | stored
    return _compiled([(cut, _pair_steps(parts[0], everything)), (len(codes), _pair_steps(parts[1], stored))])


def _pair_steps(rows: Sequence[Sequence[int]], stored: dict[int, set[int]]) -> list[_Step]:
    """Return the loops and calls that carry out operations in double-double arithmetic, of which some are stored."""
    turns, steps = _in_turn(rows, PAIR_OPERATIONS), list[_Step]()
    with_error = {position for position, some in stored.items() if ERROR in some}
    for code, out, *operands in reversed(rows):
        if with_error.intersection((out, out + ROW) if code == interpreter.SINE_COSINE else (out,)):
            with_error.update(operands)
    kept = {position: set(some) for position, some in stored.items()}
    for simple, others in turns:
        own = {row[1] for row in simple}
        elsewhere = {operand for row in simple for operand in row[2:]} - own
        for operand in elsewhere.union(*(row[2:] for row in others)):
            kept.setdefault(operand, set()).update((0, LOW, ERROR) if operand in with_error else (0, LOW))
    for simple, others in turns:
        if simple:
            steps.append(partial(_carry_out_pairs, simple, kept))
        steps += [_Call(INTERPRETER.address, np.array([row], dtype=np.int64), False) for row in others]
    return steps


def _carry_out_pairs(rows: Sequence[Sequence[int]], stored: dict[int, set[int]], body: BodyArguments) -> None:
    PairBody(*body).carry_out(rows, stored)


def of_doubles(codes: NDArray[np.int64], outputs: NDArray[np.int64]) -> MachineCode:
    """Return the machine code of operations in doubles, of which the ``outputs`` are stored."""
    rows, names = _numbered(codes)
    turns, steps, kept = _in_turn(rows, DOUBLE_OPERATIONS), list[_Step](), dict[int, int]()
    for simple, others in turns:
        own = {number for row in simple for number in _results(row)}
        for row in others:  # several results are kept one after another
            for number in (row[2], *_results(row)):
                kept.setdefault(number, BLOCK * len(kept))
        for number in (operand for row in simple for operand in row[2:] if operand < 0 and operand not in own):
            kept.setdefault(number, BLOCK * len(kept))
    stored = {names[position]: position for position in outputs.tolist() if position in names}
    for turn, (simple, others) in enumerate(turns):
        copied = [number for number in kept if number >= 0 and turn == 0]
        if simple or copied:
            steps.append(partial(_carry_out_doubles, (simple, copied), stored, kept))
        for code, out, left, _ in others:
            operation = np.array([[code, kept[out], kept[left], 0]], dtype=np.int64)
            steps.append(_Call(LANES_INTERPRETER.address, operation, True))
    return _compiled([(len(codes), steps)], BLOCK * (len(kept) + 1))


def _carry_out_doubles(
    rows: tuple[Sequence[Sequence[int]], Sequence[int]],
    stored: dict[int, int],
    kept: dict[int, int],
    body: BodyArguments,
) -> None:
    DoubleBody(body, kept).carry_out(*rows, stored)


def _results(row: Sequence[int]) -> range:
    """Return the numbers that are the results of an operation in doubles."""
    return range(row[1], row[1] - RESULTS.get(row[0], 1), -1)


def _numbered(codes: NDArray[np.int64]) -> tuple[list[list[int]], dict[int, int]]:
    """Return operations in doubles with a negative number for each result, and the last number in each register.

    In the program a register may be used for one number after another.
    """
    names, rows, count = dict[int, int](), list[list[int]](), 0
    for code, out, left, right in codes.tolist():
        if code < ERROR_BOUND:
            operands = names.get(left, left), names.get(right, right)
        else:
            operands = left if code in (ERROR_BOUND, in_lanes.FROM_PAIR) else names.get(left, left), right
        rows.append([code, -1 - count, *operands])
        for k, number in enumerate(_results(rows[-1])):
            names[out + BLOCK * k] = number
        count += RESULTS.get(code, 1)
    return rows, names


def _compiled(parts: Sequence[tuple[int, Sequence[_Step]]], scratch_size: int = 1) -> MachineCode:
    """Return a function with the arguments of an interpreter.

    Each part has the number of the operation before which it ends, and its loops and calls; it is carried out if the
    operations that are asked for end there or later and begin before.
    """
    module, kept = ir.Module(), [step.operation for _, steps in parts for step in steps if isinstance(step, _Call)]
    pointer = REAL.as_pointer()
    kind = ir.FunctionType(ir.VoidType(), [WHOLE.as_pointer(), WHOLE, WHOLE, pointer, WHOLE])
    function = ir.Function(module, kind, "carry_out")
    _, first, last, work, count = function.args
    builder = ir.IRBuilder(function.append_basic_block())
    scratch = builder.bitcast(builder.alloca(ir.ArrayType(REAL, scratch_size)), pointer)
    zero, one = ir.Constant(WHOLE, 0), ir.Constant(WHOLE, 1)
    for end, steps in parts:
        stop = ir.Constant(WHOLE, end)
        is_asked = builder.and_(builder.icmp_signed("<", first, stop), builder.icmp_signed(">=", last, stop))
        inside, outside = function.append_basic_block(), function.append_basic_block()
        builder.cbranch(is_asked, inside, outside)
        builder.position_at_end(inside)
        for step in steps:
            if isinstance(step, _Call):
                cell = builder.inttoptr(ir.Constant(WHOLE, step.address), kind.as_pointer().as_pointer())
                row = builder.inttoptr(ir.Constant(WHOLE, step.operation.ctypes.data), WHOLE.as_pointer())
                builder.call(builder.load(cell), [row, zero, one, scratch if step.in_scratch else work, count])
                continue
            before, loop, after = builder.block, function.append_basic_block(), function.append_basic_block()
            builder.branch(loop)
            builder.position_at_end(loop)
            index = builder.phi(WHOLE)
            index.add_incoming(zero, before)
            in_common = ir.IRBuilder(before)
            in_common.position_before(before.terminator)
            step((builder, builder.gep(work, [index]), builder.gep(scratch, [index]), (in_common, work)))
            following = builder.add(index, ir.Constant(WHOLE, WIDTH))
            index.add_incoming(following, builder.block)
            builder.cbranch(builder.icmp_signed("<", following, count), loop, after)
            builder.position_at_end(after)
        builder.branch(outside)
        builder.position_at_end(outside)
    builder.ret_void()
    with jit.COMPILING:
        target = binding.Target.from_default_triple()
        machine = target.create_target_machine(
            cpu=binding.get_host_cpu_name(), features=binding.get_host_cpu_features().flatten(), opt=2, jit=True
        )
        engine = binding.create_mcjit_compiler(binding.parse_assembly(str(module)), machine)
        engine.finalize_object()
    return MachineCode(engine.get_function_address("carry_out"), INTERPRETER.signature, (engine, kept))
