"""Figures written by the command line."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

from gqm_sym.errors import InputError

FORMATS = (".png", ".svg", ".pdf")


def save_figure(draw: Callable[[], Any], file: str) -> None:
    """Draw a figure into a file.

    Parameters
    ----------
    draw : callable
        Returns a Matplotlib figure.
    file : str
        The file to write; its extension selects the format.

    Raises
    ------
    InputError
        If the extension is not that of a known format.
    """
    from gqm_sym.building import write_bytes

    extension = Path(file).suffix.lower()
    if extension not in FORMATS:
        raise InputError(f"{file}: the format of the figure is unknown; use a name that ends in {', '.join(FORMATS)}")
    # Without the date of creation the same figure gives the same bytes.
    metadata = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    image = BytesIO()
    draw().savefig(image, format=extension[1:], metadata=metadata[extension])
    write_bytes(image.getvalue(), file)
