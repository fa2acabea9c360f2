"""Second derivatives of half periods and times of laps, recorded as tapes (`programs`)."""

from functools import lru_cache
from itertools import combinations_with_replacement

from gqm_sym.runtime.double_double.recording import Recorder
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.programs import LAUNCH_VARIABLES, Program, Source, assemble, lap_rate


@lru_cache(maxsize=16)
def turning_point_seconds(source: Source, rows: tuple[int, ...]) -> Program:
    """Return the program of `turning_point_program` with the second derivatives with respect to the pairs of variables
    (`pairs_of`) in ``rows``.
    """
    op = Recorder(source.variables)
    here = source.local(op, op.place)
    step, *moves = [-(part / here.half_slope) for part in (here.half, *here.half_partials)]
    changes = {i: gradient(op, moves[i], [op.place, *op.values]) for i in rows}
    seconds = [changes[i][1 + j] + changes[i][0] * moves[j] for i, j in pairs_of(rows)]
    return assemble(op, [step, *moves, *seconds])


def pairs_of(rows: tuple[int, ...]) -> list[tuple[int, int]]:
    """Return the pairs of variables that have second derivatives: each variable with itself and with those after it."""
    return list(combinations_with_replacement(rows, 2))


@lru_cache(maxsize=16)
def libration_seconds(source: Source, rows: tuple[int, ...]) -> Program:
    """Return the program of dt/dphi and its second derivatives at the same phase angle, with respect to the pairs of
    variables in ``rows``.

    The inputs are those of `libration_program`, where the first derivatives of each turning point are followed by the
    second ones.
    """
    n, pairs = source.variables, pairs_of(rows)
    op = Recorder(n + 2 * (1 + n + len(pairs)))
    a, b, *ends = op.values[n:]
    low, high, share = ends[: len(ends) // 2], ends[len(ends) // 2 :], op.place
    width = b - a
    lam = a + width * share
    half, half_slope, half_partials, ds, ds_slope, ds_partials = source.local(op, lam)
    rate = width * op.sqrt(share * (1 - share)) * ds / op.sqrt(2 * half)
    by_launch = [op.number(0)] * LAUNCH_VARIABLES
    moved = [at_low + (at_high - at_low) * share for at_low, at_high in zip(low, high, strict=True)]
    wider = [(at_high - at_low) / width for at_low, at_high in zip(low, high, strict=True)]
    # The changes of half of V**2 and of ds/dlam are computed as a whole, because their parts are large near the turning
    # points.
    faster = [part + half_slope * move for part, move in zip(half_partials, moved, strict=False)]
    longer = [part + ds_slope * move for part, move in zip([*ds_partials, *by_launch], moved, strict=False)]
    log_rates = [wider[k] + longer[k] / ds - faster[k] / (2 * half) for k in range(n)]
    second = {k: [gradient(op, q[k], [lam, *op.values[:n]]) for q in (faster, longer)] for k in rows}
    outputs = [rate]
    for k, (i, j) in enumerate(pairs, start=n):
        by_half, by_ds = (by[1 + j] + by[0] * moved[j] for by in second[i])
        by_half, by_ds = by_half + half_slope * moved[k], by_ds + ds_slope * moved[k]
        change = wider[k] - wider[i] * wider[j] + by_ds / ds - longer[i] * longer[j] / (ds * ds)
        change = change - (by_half - faster[i] * faster[j] / half) / (2 * half)
        outputs.append(rate * (log_rates[i] * log_rates[j] + change))
    return assemble(op, outputs)


@lru_cache(maxsize=16)
def circulation_seconds(source: Source, direction: int, rows: tuple[int, ...]) -> Program:
    """Return the program of dt/dshare and its second derivatives at the same share of a lap, with respect to the pairs
    of variables in ``rows``.
    """
    op, *_, rate = lap_rate(source, direction)
    first = gradient(op, rate, op.values[: source.variables])
    second = {i: gradient(op, first[i], op.values[: source.variables]) for i in rows}
    return assemble(op, [rate, *(second[i][j] for i, j in pairs_of(rows))])
