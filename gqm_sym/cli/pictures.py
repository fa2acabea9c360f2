"""Figures from the command line."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from gqm_sym.errors import InputError

if TYPE_CHECKING:
    from gqm_sym.runtime.motion.motion import Motion

FORMATS = (".png", ".svg", ".pdf")


def save_figure(motion: "Motion", file: str, what: str) -> None:
    """Draw a motion into a file.

    Raises
    ------
    InputError
        For a file whose ending is no known format, or that cannot be written.
    """
    from gqm_sym.building import write_bytes

    ending = Path(file).suffix.lower()
    if ending not in FORMATS:
        raise InputError(f"{file}: cannot tell the format of the figure; end its name in {', '.join(FORMATS)}")
    # The same motion gives the same bytes: no date of making.
    dated = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    drawn = BytesIO()
    motion.plot(what).savefig(drawn, format=ending[1:], metadata=dated[ending])
    write_bytes(drawn.getvalue(), file)
