"""`gqm`: what is not generation."""

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gqm_sym.cli import show
from gqm_sym.cli.exits import DONE, guarded
from gqm_sym.cli.pictures import save_figure
from gqm_sym.errors import ParameterError

if TYPE_CHECKING:
    from gqm_sym.declare.families import Family
    from gqm_sym.derivation import Model
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.specfile import Spec

PROGRAM = "gqm"
FOLDER = "generated"

_EXACT = "Numbers are taken exactly as written. One that begins with a minus needs an equals sign: --lam0=-pi/2."

# Options of commands that replace entries of the file's launch, by their names in ``solve``.
_LAUNCH = ("lam0", "v0", "direction", "t_max", "contact")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return guarded(PROGRAM, lambda: _run(argv))


def _run(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    options.command(options)
    return DONE


def _launching() -> argparse.ArgumentParser:
    """Options of commands that run a launch."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("file", metavar="FILE", help="a curve file (YAML)")
    parser.add_argument("--lam0", metavar="NUMBER", help="launch from another place")
    parser.add_argument("--v0", metavar="NUMBER", help="launch with another speed")
    parser.add_argument("--direction", type=int, choices=(1, -1), help="sign of ds/dt at launch")
    parser.add_argument("--t-max", metavar="NUMBER", help="follow the motion for so long")
    parser.add_argument("--contact", choices=("bilateral", "above", "below"))
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="values",
        metavar="NAME=NUMBER",
        help="give a run-time parameter another value; may be repeated",
    )
    return parser


def _modules() -> argparse.ArgumentParser:
    """Where commands that run a launch look for modules."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        default=FOLDER,
        dest="folder",
        help=f"where generated modules lie: a current one is used (default: {FOLDER})",
    )
    return parser


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=PROGRAM, description="Motion on planar curves: what is not generation (see gqm-gen)."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    solve = commands.add_parser(
        "solve",
        parents=[_launching(), _modules()],
        help="run the launch of a curve file",
        description="Run the launch of a curve file and print its table. Nothing is written.",
        epilog=_EXACT,
    )
    solve.add_argument(
        "--at",
        action="append",
        default=[],
        metavar="TIME",
        help="also print the state at this time; may be repeated",
    )
    solve.set_defaults(command=_solve)

    plot = commands.add_parser(
        "plot",
        parents=[_launching(), _modules()],
        help="draw the motion that a curve file launches",
        description="Run the launch of a curve file and draw its motion.",
        epilog=_EXACT,
    )
    plot.add_argument("figure", metavar="FIGURE", help="the file to write: its ending says the format (png, svg, pdf)")
    plot.add_argument(
        "--what",
        choices=("track", "loads", "portrait"),
        default="track",
        help="the track coloured by the contact force, speed and force against arc length, or the phase portrait "
        "(default: track)",
    )
    plot.set_defaults(command=_plot)

    report = commands.add_parser(
        "report",
        parents=[_launching()],
        help="write a page about the motion that a curve file launches",
        description="Run the launch of a curve file and write one page about it, complete in itself: formulas, "
        "figures, events, and what it was made from.",
        epilog=_EXACT,
    )
    report.add_argument(
        "-o", "--output", metavar="FILE", help="the page (HTML); the name in the curve file with .html if not given"
    )
    report.set_defaults(command=_report, folder=FOLDER)

    sweep = commands.add_parser(
        "sweep",
        help="compute quantities over many launches and parameters",
        description="Compute what a sweep file asks, on all cores or on a Dask cluster, into a file with names, units "
        "and provenance. What is done is stored as it goes: run an interrupted sweep again and it goes on.",
    )
    sweep.add_argument("file", metavar="FILE", help="a sweep file (YAML)")
    sweep.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="the results, .nc (netCDF) or .zarr; the name of the sweep file with .nc if not given",
    )
    sweep.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster to do the work, as in tcp://host:8786")
    sweep.add_argument("--force", action="store_true", help="begin anew, whatever is there")
    sweep.set_defaults(command=_sweep)

    schema = commands.add_parser("schema", help="print the JSON Schema of curve files, for editors")
    schema.add_argument("--sweep", action="store_true", help="that of sweep files")
    schema.set_defaults(command=_schema)
    families = commands.add_parser("families", help="list the families of curves")
    families.set_defaults(command=_families)
    kernels = commands.add_parser("kernels", help="list the forces")
    kernels.set_defaults(command=_kernels)
    return parser


# -- solve, plot and report --------------------------------------------------------------------------


def _launched(options: argparse.Namespace) -> "tuple[Spec, Model, Motion]":
    """What a file says, and the motion that it and the options launch."""
    from gqm_sym.emission import emit
    from gqm_sym.specfile import read_spec

    spec = read_spec(options.file)
    model = spec.derive()
    given = {key: getattr(options, key) for key in _LAUNCH if getattr(options, key) is not None}
    values = dict(_assignment(text, model.parameters) for text in options.values)
    if not given and not values:
        spec.check_solvable(model)
    written = dict(spec.launch or {})
    if "lam0" in given:
        written.pop("point", None)
    launch = {**written, **given, **values}
    module = _module(emit(model, name=spec.name), spec.name, Path(options.folder))
    return spec, model, module.solve(**launch)


def _plot(options: argparse.Namespace) -> None:
    *_, motion = _launched(options)
    save_figure(motion, options.figure, options.what)
    print(f"wrote {options.figure}")


def _report(options: argparse.Namespace) -> None:
    from gqm_sym.building import write_text
    from gqm_sym.report import report

    spec, model, motion = _launched(options)
    page = report(spec, model, motion, Path(options.file).read_text(encoding="utf-8-sig"))
    path = options.output or f"{spec.name}.html"
    write_text(page, path)
    print(f"wrote {path}")


def _solve(options: argparse.Namespace) -> None:
    _, model, motion = _launched(options)
    lines = list(show.motion(motion, model.parameter.name))
    if options.at:
        lines += ["", *show.moments(motion, model.parameter.name, options.at)]
    # Printed when all of it is there: a question about a time may have no answer.
    print("\n".join(lines))


def _assignment(text: str, known: Sequence[str]) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or name.strip() not in known:
        raise ParameterError(f"--set {text}: must be NAME=NUMBER with one of the parameters {', '.join(known)}")
    return name.strip(), value.strip()


def _module(text: str, name: str, folder: Path) -> Any:
    """Return the generated module: the current one on disk, or one in a temporary folder."""
    from gqm_sym.building import difference, load, write_module

    present = folder / f"{name}.py"
    if present.is_file() and not difference(text, present):
        return load(present, name)
    with tempfile.TemporaryDirectory(prefix="gqm-") as temporary:
        path = Path(temporary) / present.name
        write_module(text, path)
        return load(path, name)


# -- sweep -----------------------------------------------------------------------------------


def _sweep(options: argparse.Namespace) -> None:
    from gqm_sym.cli.progress import Bar
    from gqm_sym.runtime.sweep.cluster import connected
    from gqm_sym.studies import read_sweep, run

    plan = read_sweep(options.file)
    target = options.output or f"{Path(options.file).stem}.nc"
    bar = Bar()
    with nullcontext() if options.scheduler is None else connected(options.scheduler) as client:
        try:
            data = run(plan, target, client=client, force=options.force, progress=bar)
        except KeyboardInterrupt:
            print(f"{PROGRAM}: what is done is stored; the same command goes on from there", file=sys.stderr)
            raise
        finally:
            bar.close()
    for line in show.swept(plan.quantities, data):
        print(line)
    print(f"wrote {target}")


# -- lists -----------------------------------------------------------------------------------


def _schema(options: argparse.Namespace) -> None:
    if options.sweep:
        from gqm_sym.studies import sweep_schema

        schema = sweep_schema()
    else:
        from gqm_sym.specfile import json_schema

        schema = json_schema()
    print(json.dumps(schema, indent=2, ensure_ascii=False))


def _families(options: argparse.Namespace) -> None:
    from gqm_sym.declare.families import FAMILIES

    print("cartesian_graph(phi)\n    z = phi(x)\n    The graph of any function of x.")
    for row in FAMILIES.values():
        print(f"{row.name}({', '.join(row.arguments)})")
        print(f"    {', '.join(_formulas(row))}")
        print(f"    {row.title}{f'; {row.note}' if row.note else ''}.")
    print("implicit(F, start)\n    F(x, z) = 0\n    The curve through the point start, in arc length from there.")


def _formulas(row: "Family") -> list[str]:
    parts = [f"{label} = {text}" for label, text in (("r", row.r), ("x", row.x), ("z", row.z)) if text]
    if row.domain:
        parts.append(f"{row.domain[0]} <= {row.parameter} <= {row.domain[1]}")
    if row.period:
        parts.append(f"period {row.period}")
    return parts


def _kernels(options: argparse.Namespace) -> None:
    from gqm_sym.kernels import KERNELS

    titles = ("in YAML", "in Python", "what it is")
    rows = [
        (
            f"{row.name}: {{{', '.join(row.arguments)}}}",
            f"{row.make.__qualname__}({', '.join(row.arguments)})",
            row.summary,
        )
        for row in KERNELS.values()
    ]
    for line in show.table([titles, *rows], right=()):
        print(line)
