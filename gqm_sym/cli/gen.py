"""`gqm-gen`: curve files -> generated modules."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gqm_sym.cli import show
from gqm_sym.cli.exits import DIFFERENT, DONE, Failures, guarded
from gqm_sym.cli.pictures import save_figure
from gqm_sym.errors import InputError

if TYPE_CHECKING:
    from gqm_sym.derivation import Model
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.specfile import Spec

PROGRAM = "gqm-gen"
FOLDER = "generated"


@dataclass(frozen=True, slots=True, kw_only=True)
class Product:
    """The results of one curve file: the model, the text of its module and the path of the module."""

    spec: "Spec"
    model: "Model"
    text: str
    path: Path


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return guarded(PROGRAM, lambda: _run(_arguments(argv)))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        description="Derive the closed forms of motion along a curve and write its module.",
        epilog="Exit codes: 0 done, 1 --check found a difference, 2 the input is wrong, "
        "3 the derivation or the solution failed, 130 interrupted.",
    )
    parser.add_argument("files", nargs="*", metavar="FILE", help="a curve file (YAML)")
    parser.add_argument(
        "--init", metavar="NAME", help="write NAME.yaml, a commented curve file to start from, and do nothing else"
    )
    parser.add_argument(
        "-o", "--output", metavar="DIR", default=FOLDER, help=f"folder to write modules into (default: {FOLDER})"
    )
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a module is not up to date")
    mode.add_argument("--stdout", action="store_true", help="print the module and write no file")
    mode.add_argument(
        "--solve", action="store_true", help="also run the launch in the file and print the motion as a table"
    )
    parser.add_argument("--diff", action="store_true", help="with --check: print the differences")
    parser.add_argument("--latex", metavar="FILE", help="also write the closed forms into a LaTeX file")
    parser.add_argument(
        "--plot", metavar="FILE", help="also run the launch in the file and draw its motion (.png, .svg, .pdf)"
    )
    parser.add_argument("--force", action="store_true", help="overwrite a module that was edited by hand")
    parser.add_argument("-q", "--quiet", action="store_true", help="do not print the closed forms")
    return parser


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = _parser()
    options = parser.parse_args(argv)
    if options.init is not None:
        if options != parser.parse_args(["--init", options.init]):
            parser.error("--init: takes one NAME and no other argument")
        return options
    if not options.files:
        parser.error("the following arguments are required: FILE (or --init NAME)")
    if options.diff and not options.check:
        parser.error("--diff: prints the differences that --check finds; give both options")
    if options.latex is not None and options.check:
        parser.error("--latex: writes a file, but --check writes nothing; give only one of them")
    if options.plot is not None and (options.check or options.stdout):
        parser.error("--plot: runs the module that is written; leave out --check and --stdout")
    single_file_options = {
        "--stdout": options.stdout,
        "--latex": options.latex is not None,
        "--plot": options.plot is not None,
    }
    for option, given in single_file_options.items():
        if given and len(options.files) > 1:
            parser.error(f"{option}: takes one FILE, got {len(options.files)}")
    return options


def _run(options: argparse.Namespace) -> int:
    """Read all files and make all modules before anything is written, so that a mistake leaves every file unchanged."""
    if options.init is not None:
        return _init(options.init)
    failures = Failures()
    specs: list[Spec] = []
    for file in options.files:
        with failures.recording(file):
            specs.append(_read(file, specs))
    products: list[Product] = []
    for spec in specs:
        with failures.recording(spec.path):
            products.append(_make(spec, options))
    if failures:
        return failures.code
    if options.check:
        return _check(products, options)
    for product in products:
        with failures.recording(product.spec.path):
            _deliver(product, options)
    return failures.code


def _init(name: str) -> int:
    from gqm_sym.specfile import starter

    text, path = starter(name), Path(f"{name}.yaml")
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: already exists and was not changed; choose another name") from None
    print(f"wrote {path}")
    return DONE


def _read(file: str, others: "Sequence[Spec]") -> "Spec":
    from gqm_sym.specfile import read_spec

    spec = read_spec(file)
    for other in others:
        if other.name == spec.name:
            raise spec.mistake(
                f"name: {spec.name} is also the name in {other.path}, and both would be written to the same file; "
                "rename one of them"
            )
    return spec


def _make(spec: "Spec", options: argparse.Namespace) -> Product:
    from gqm_sym.emission import emit

    model = spec.derive()
    if options.solve or options.plot is not None:
        spec.check_solvable(model)
    path = Path(options.output) / f"{spec.name}.py"
    return Product(spec=spec, model=model, text=emit(model, name=spec.name), path=path)


def _check(products: Sequence[Product], options: argparse.Namespace) -> int:
    from gqm_sym.building import difference

    code = DONE
    for product in products:
        changes = difference(product.text, product.path)
        if changes:
            code = DIFFERENT
            what = "differs from what" if product.path.exists() else "is missing; it is what"
            print(
                f"{product.path}: {what} {product.spec.path} gives; "
                f"write it with {PROGRAM} -o {options.output} {product.spec.path}",
                file=sys.stderr,
            )
            if options.diff:
                print(changes, end="" if changes.endswith("\n") else "\n")
        elif not options.quiet:
            print(f"{product.path} is current")
    return code


def _deliver(product: Product, options: argparse.Namespace) -> None:
    """Print and write the results that the options select."""
    from gqm_sym.building import write_module, write_text

    if options.latex is not None:
        write_text(_latex(product), options.latex)
    if options.stdout:
        sys.stdout.write(product.text)
        return
    changed = write_module(product.text, product.path, force=options.force)
    if not options.quiet:
        for line in show.forms(product.spec, product.model):
            print(line)
        print()
        if options.latex is not None:
            print(f"wrote {options.latex}")
        print(f"wrote {product.path}" if changed else f"{product.path} is current")
    if not (options.solve or options.plot is not None):
        return
    motion = _motion(product)
    if options.plot is not None:
        save_figure(lambda: motion.plot("track"), options.plot)
        if not options.quiet:
            print(f"wrote {options.plot}")
    if options.solve:
        # The table is complete before its first line is printed, since it may fail half way.
        table = list(show.motion(motion, product.model.parameter.name))
        print(f"{product.spec.name}:" if options.quiet else "")
        for line in table:
            print(line)


def _motion(product: Product) -> "Motion":
    """Return the motion that starts from the launch in the file."""
    from gqm_sym.building import load

    spec = product.spec
    module = load(product.path, spec.name)
    try:
        motion: Motion = module.solve(**(spec.launch or {}))
    except InputError as error:
        raise spec.mistake(str(error), "launch") from None
    return motion


def _latex(product: Product) -> str:
    return f"% Made by {PROGRAM} for {product.spec.name}; needs amsmath.\n\\[\n{product.model.latex()}\n\\]\n"
