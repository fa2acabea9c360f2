"""Old public names of figures say their new ones."""

import pytest

import gqm_sym as gqm
from gqm_sym.figures import RENAMED


@pytest.mark.parametrize(("old", "new"), RENAMED.items())
def test_an_old_name_says_the_new_one(old: str, new: str) -> None:
    """The AttributeError names the function to use, which exists."""
    with pytest.raises(AttributeError, match=f"'{old}'; its new name is '{new}'"):
        getattr(gqm.figures, old)
    assert callable(getattr(gqm.figures, new))


def test_a_name_that_never_was() -> None:
    """A name that never existed gives the ordinary message."""
    with pytest.raises(AttributeError, match=r"has no attribute 'hodograph'$"):
        _ = gqm.figures.hodograph
