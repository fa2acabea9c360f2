"""A report on a motion, as one self-contained page with formulas (MathML), figures (inline SVG), tables and the input.

The page is both HTML and well-formed XML, needs neither a network nor scripts, and is the same bytes for the same
input.
"""

import io
import platform
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from html import escape, unescape
from importlib.metadata import version
from typing import TYPE_CHECKING

import sympy as sp

from gqm_sym.derivation import Model
from gqm_sym.errors import SolutionError
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION
from gqm_sym.optional import require
from gqm_sym.runtime import Motion
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.launch.kinds import LOADS
from gqm_sym.runtime.launch.rider import STANDARD_GRAVITY
from gqm_sym.runtime.motion.parts.summary import summary
from gqm_sym.runtime.motion.rows import Rows, table
from gqm_sym.specfile import Spec
from gqm_sym.sympy_charts import ChartFunction

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = {
    "track": "The part of the track that the body runs through, coloured by the contact force",
    "speed_and_force": "Speed and contact force against arc length",
    "portrait": "Phase portrait, with the orbit of this launch",
}

# SymPy prints the names of functions as they are written.
_GREEK = {"alpha": "α", "kappa": "κ"}

# Labels of partial derivatives: dF/dx, d2F/dx2, d2F/dxdz.
_PARTIAL = re.compile(r"d(2?)F/d(\w)d?(\w?)")

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1, h2 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto; font-size: 0.85rem; }
th, td { padding: 0.2rem 0.6rem; text-align: left; white-space: nowrap; border-bottom: 1px solid #ddd; }
td { font-variant-numeric: tabular-nums; }
math { font-size: 1.1rem; } .formula { overflow-x: auto; overflow-y: hidden; padding: 0.3rem 0; }
figure { margin: 1rem 0; } svg { max-width: 100%; height: auto; } figcaption { color: #555; font-size: 0.9rem; }
pre { background: #f6f6f6; padding: 1rem; white-space: pre-wrap; }
@media print { body { max-width: none; } h2 { break-after: avoid; } figure { break-inside: avoid; } }
"""


@require("plot")
def report(spec: Spec, model: Model, motion: Motion, text: str) -> str:
    """Return the report on one motion as HTML.

    Parameters
    ----------
    spec : Spec
        The curve file, as `read_spec` returns it.
    model : Model
        The model that was derived from it.
    motion : Motion
        The motion to report on.
    text : str
        The text of the curve file, which is printed in the report.

    Returns
    -------
    str
        The page.
    """
    title = escape(f"{spec.name}: {model.title}" if model.title else spec.name)
    parts = [
        f"<h1>{title}</h1>",
        _table_of_facts(summary(motion)),
        "<h2>The motion</h2>",
        *_figures(motion),
        *_riders(motion),
        "<h2>Events</h2>",
        Rows(motion.events)._repr_html_(),
        "<h2>Legs</h2>",
        Rows(motion.legs)._repr_html_(),
        "<h2>Closed forms</h2>",
        *_formulas(model),
        "<h2>Parameters</h2>",
        _parameters(spec, motion),
        "<h2>Input</h2>",
        f"<pre>{escape(text)}</pre>",
        _table_of_facts(_provenance(motion)),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en" xmlns="http://www.w3.org/1999/xhtml">\n<head>\n<meta charset="utf-8"/>\n'
        f'<meta name="viewport" content="width=device-width"/>\n<title>{title}</title>\n<style>{STYLE}</style>\n'
        f"</head>\n<body>\n{chr(10).join(parts)}\n</body>\n</html>\n"
    )


def _table_of_facts(rows: Iterable[tuple[str, object]]) -> str:
    lines = "".join(f"<tr><th>{escape(label)}</th><td>{escape(str(value))}</td></tr>" for label, value in rows)
    return f"<table><tbody>{lines}</tbody></table>"


def _parameters(spec: Spec, motion: Motion) -> str:
    rows = []
    for name, number in zip(motion.problem.formulas.parameters, motion.problem.p, strict=True):
        note = spec.notes.get(name)
        rows.append((name, number.text, note.unit if note else "", note.description if note else ""))
    return table(("name", "value", "unit", "description"), rows)


def _provenance(motion: Motion) -> Iterator[tuple[str, str]]:
    launch = motion.problem.launch
    yield "launch", f"lam0 = {launch.lam0.text}, v0 = {launch.v0.text}, direction = {launch.direction:+d}"
    yield "contact", launch.contact
    if launch.t_max is not None:
        yield "t_max", f"{launch.t_max.text} s"
    yield "error bound of the curve parameter at the last event", f"{motion.error_bound(_last(motion)):.1e}"
    for package in ("gqm_sym", "sympy", "numpy", "numba"):
        yield package, version(package)
    yield "Python", platform.python_version()


def _last(motion: Motion) -> float:
    return max((event.t for event in motion.events), default=0.0)


# -- formulas --------------------------------------------------------------------------------


def _formulas(model: Model) -> Iterator[str]:
    """Yield each closed form as a block of MathML."""
    lam = model.parameter.name
    symbols = {model.lam0: sp.Symbol(f"{lam}_0"), model.v0: sp.Symbol("V_0")}
    symbols |= {DIRECTION: sp.Symbol("sgn V"), CONTACT_SIGN: sp.Symbol("sgn N")}
    for label, form in model.closed_forms():
        charted = {head: sp.Function(_GREEK.get(head.row, head.row))(*head.args) for head in form.atoms(ChartFunction)}
        for integral in form.atoms(sp.Integral):
            symbols |= {bound: sp.Symbol(f"{bound.name.strip('_')}'") for bound in integral.variables}
        shown = form.xreplace(charted).xreplace(symbols)
        if isinstance(shown, sp.Equality):
            note = f'<mspace width="2em"/><mtext>({escape(label)})</mtext>'
            inner = f"{_mathml(shown.lhs)}<mo>=</mo>{_mathml(shown.rhs)}{note}"
        else:
            inner = f"{_label(label)}<mo>=</mo>{_mathml(shown)}"
        math = f'<math xmlns="http://www.w3.org/1998/Math/MathML" display="block"><mrow>{inner}</mrow></math>'
        yield f'<div class="formula">{math}</div>'
    for note in model.notes:
        yield f"<p>{escape(note)}</p>"


def _label(label: str) -> str:
    """Return the left side of a closed form, such as ds/dtheta, V**2 or W = V**2, as MathML."""
    if " = " in label:
        return "<mo>=</mo>".join(map(_label, label.split(" = ")))
    if found := _PARTIAL.fullmatch(label):
        order, first, second = found.groups()
        above, below = _power("<mo>∂</mo>", order), _power(f"<mi>{first}</mi>", "2" if second == "2" else "")
        mixed = f"<mo>∂</mo><mi>{second}</mi>" if second not in ("", "2") else ""
        return f"<mfrac><mrow>{above}<mi>F</mi></mrow><mrow><mo>∂</mo>{below}{mixed}</mrow></mfrac>"
    if "/" in label:
        above, below = (f"<mrow><mi>d</mi>{_mathml(sp.Symbol(part[1:]))}</mrow>" for part in label.split("/"))
        return f"<mfrac>{above}{below}</mfrac>"
    return _mathml(sp.Symbol("V") ** 2 if label == "V**2" else sp.Symbol(label))


def _power(base: str, exponent: str) -> str:
    return f"<msup>{base}<mn>{exponent}</mn></msup>" if exponent else base


def _mathml(form: sp.Basic) -> str:
    # XML does not have the named entities of HTML.
    text: str = sp.mathml(form, printer="presentation")
    return re.sub(r"&[A-Za-z]\w+;", lambda found: _character(found[0]), _with_written_parentheses(text))


def _with_written_parentheses(text: str) -> str:
    """Write parentheses as characters, because SymPy before 1.14 uses an element for them that browsers no longer
    draw.
    """
    closing: list[str] = []

    def replaced(found: re.Match[str]) -> str:
        if found[0].startswith("</"):
            return f"<mo>{closing.pop()}</mo></mrow>"
        marks = dict(re.findall(r'(\w+)="([^"]*)"', found[0]))
        closing.append(marks.get("close", ")"))
        return f"<mrow><mo>{marks.get('open', '(')}</mo>"

    return re.sub(r"</?mfenced[^>]*>", replaced, text)


def _character(entity: str) -> str:
    # XML's own entities are kept. SymPy's double-struck e is missing from most fonts and is replaced by a plain one.
    return entity if entity in ("&lt;", "&gt;", "&amp;", "&quot;") else unescape(entity).replace("\u2147", "e")


# -- figures ---------------------------------------------------------------------------------


def _figures(motion: Motion) -> Iterator[str]:
    for what, caption in FIGURES.items():
        if what == "track" and motion.problem.formulas.rider_loads is not None:
            continue  # the figure of the ride contains the track
        # A motion that loses energy has no phase portrait.
        with suppress(SolutionError):
            yield _svg(motion.plot(what), what, caption)


def _riders(motion: Motion) -> Iterator[str]:
    """Yield the loads on riders of a banked track: their extremes, and for a train those in three cars."""
    from gqm_sym.figures.rides import SEAT_TIMES, ride, seat_extremes, seats

    if motion.problem.formulas.rider_loads is None:
        return
    yield "<h2>What riders feel</h2>"
    yield f"<p>Loads are in units of {STANDARD_GRAVITY} m/s².</p>"
    rows = []
    for load in LOADS:
        least, most = getattr(motion, f"n_{load}_min"), getattr(motion, f"n_{load}_max")
        rows.append((load, *(f"{number:.4f}" for number in (least.value, least.t, most.value, most.t))))
    yield table(("load", "least", "after (s)", "most", "after (s)"), rows)
    if isinstance(motion.problem.formulas.chart, TrackOfTrain):
        rows = [(seat, *(f"{load:.3f}" for load in felt)) for seat, *felt in seat_extremes(motion)]
        heads = [f"{load}, {which}" for load in LOADS for which in ("least", "most")]
        yield f"<p>The same in three cars of the train, at {SEAT_TIMES} times:</p>"
        yield table(("car", *heads), rows)
        yield _svg(seats(motion), "seats", "What riders feel in three cars, against the place of their car")
    yield _svg(ride(motion), "ride", "The track with the vertical load, its plan and elevation, and all loads along it")


def _svg(figure: "Figure", name: str, caption: str) -> str:
    """Return a figure as an element of the page; the prefix ``name`` makes its ids unique there."""
    import matplotlib as mpl

    stream = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", text)
    label = escape(caption)
    return f'<figure role="img" aria-label="{label}">{text.strip()}<figcaption>{label}</figcaption></figure>'
