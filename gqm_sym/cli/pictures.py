"""Figures written by the command line."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from gqm_sym.errors import InputError

if TYPE_CHECKING:
    from gqm_sym.runtime.motion.motion import Motion

FORMATS = (".png", ".svg", ".pdf")


def save_figure(motion: "Motion", file: str, what: str) -> None:
    """Draw a motion into a file.

    Parameters
    ----------
    motion : Motion
        The motion.
    file : str
        The file to write; its extension selects the format.
    what : str
        The figure to draw, as for `Motion.plot`.

    Raises
    ------
    InputError
        If the extension is not that of a known format.
    """
    from gqm_sym.building import write_bytes

    extension = Path(file).suffix.lower()
    if extension not in FORMATS:
        raise InputError(f"{file}: the format of the figure is unknown; use a name that ends in {', '.join(FORMATS)}")
    # Without the date of creation the same motion gives the same bytes.
    metadata = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    image = BytesIO()
    motion.plot(what).savefig(image, format=extension[1:], metadata=metadata[extension])
    write_bytes(image.getvalue(), file)
