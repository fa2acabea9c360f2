"""The tree of exceptions shows which errors are the user's to correct, and errors can be sent to other processes."""

import pickle

import pytest

from gqm_sym import errors

INPUT = {
    "ExpressionError",
    "NumberError",
    "DeclarationError",
    "SpecFileError",
    "LaunchError",
    "ParameterError",
    "HandEditedError",
}
OTHER = {"DerivationError", "EmissionError", "SolutionError", "OutdatedModuleError"}


@pytest.mark.parametrize("name", sorted(INPUT | OTHER))
def test_every_error_is_a_gqm_error_with_one_line_of_doc(name):
    """Users catch GQMError; those whose input is wrong are InputErrors, and no others."""
    kind = getattr(errors, name)
    assert issubclass(kind, errors.GQMError)
    assert issubclass(kind, errors.InputError) == (name in INPUT)
    assert kind.__doc__.splitlines()[0].endswith(".")


def test_mistakes_of_a_file_are_joined_line_by_line():
    """All mistakes are shown in order, also after pickling."""
    error = errors.SpecFileError(["a.yaml:1:2: one", "a.yaml:3:4: two"])
    assert str(error) == "a.yaml:1:2: one\na.yaml:3:4: two"
    assert pickle.loads(pickle.dumps(error)).mistakes == error.mistakes
    assert errors.SpecFileError("just one").mistakes == ("just one",)
