"""Modules are written completely or not at all, and imported from any folder."""

import errno
import os
import py_compile
from collections.abc import Callable
from math import pi, sqrt
from pathlib import Path
from types import ModuleType
from typing import Any
from weakref import WeakValueDictionary

import pytest

import gqm_sym as gqm
from gqm_sym.building import difference, load, write_module, write_text
from gqm_sym.errors import GQMError, HandEditedError, InputError, OutdatedModuleError
from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.interface import INTERFACE

LONG_AGO = 1_000_000_000


def emitted(z: str = "6*x**2", *, name: str = "bowl") -> str:
    """Emit a small module."""
    return gqm.emit(gqm.derive(gqm.Curve.graph(z), gqm.Gravity()), name=name)


@pytest.fixture(scope="module")
def text() -> str:
    """Return the text of a small module."""
    return emitted()


@pytest.fixture
def path(text: str, tmp_path: Path) -> Path:
    """Return the path of that module, written long ago."""
    target = tmp_path / "bowl.py"
    assert write_module(text, target)
    os.utime(target, (LONG_AGO, LONG_AGO))
    return target


def names_in(folder: Path) -> list[str]:
    """Return the names in a folder."""
    return sorted(entry.name for entry in folder.iterdir())


def half_period(module: ModuleType) -> float:
    """Return the half period of a small motion, π/sqrt(2*g*k) in the bowl k*x**2, up to 1e-10 of it."""
    return module.solve("-1e-6").half_period


def test_a_module_is_written_to_a_new_folder(text: str, tmp_path: Path) -> None:
    """Missing folders are created; the file has the text with the usual permissions, and there is no other file."""
    target = tmp_path / "one" / "two" / "bowl.py"
    assert write_module(text, target)
    assert target.read_bytes() == text.encode()
    mask = os.umask(0)
    os.umask(mask)
    assert target.stat().st_mode & 0o777 == 0o666 & ~mask
    assert names_in(target.parent) == ["bowl.py"]


def test_what_is_the_same_is_not_written(text: str, path: Path) -> None:
    """The file keeps its time, so that no program that watches it starts anew."""
    assert not write_module(text, path)
    assert path.stat().st_mtime == LONG_AGO
    assert not write_module(text, path, force=True)
    assert path.stat().st_mtime == LONG_AGO


def test_line_ends_of_another_system_are_no_difference(text: str, path: Path) -> None:
    """A file with other line ends does not count as edited by hand."""
    path.write_bytes(text.replace("\n", "\r\n").encode())
    assert not write_module(text, path)
    assert difference(text, path) == ""
    assert write_module(emitted("7*x**2"), path)


def test_what_gqm_gen_wrote_is_overwritten(path: Path) -> None:
    """A module as it was written gives way to the next version."""
    changed = emitted("7*x**2")
    assert write_module(changed, path)
    assert path.read_text(encoding="utf-8") == changed


@pytest.mark.parametrize(
    "edit",
    [
        lambda text: text + "\n",
        lambda text: text.replace("range(n)", "range(n - 1)"),
        lambda text: text.replace("body ", "body 0", 1),
        lambda text: text.partition("\n")[2],
        lambda _: "print('mine')\n",
        lambda _: "",
        lambda _: "# Made by gqm-gen, as one might think\n",
    ],
    ids=["line added", "body", "digest", "header removed", "another program", "empty", "only half a header"],
)
def test_what_was_edited_is_kept(edit: Callable[[str], str], text: str, path: Path) -> None:
    """A file that is not as gqm-gen left it is refused by its path, and overwritten only by force."""
    mine = edit(text)
    path.write_text(mine, encoding="utf-8")
    with pytest.raises(HandEditedError, match=r"bowl\.py: .*--force"):
        write_module(text, path)
    assert path.read_text(encoding="utf-8") == mine
    assert write_module(text, path, force=True)
    assert path.read_text(encoding="utf-8") == text


def test_a_binary_file_is_kept(text: str, path: Path) -> None:
    """Bytes that are no text were not written by gqm-gen."""
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(HandEditedError):
        write_module(text, path)
    assert path.read_bytes() == b"\xff\xfe\x00"
    assert difference(text, path).count("\n+") == len(text.splitlines()) + 1


def test_a_link_is_not_followed(text: str, path: Path, tmp_path: Path) -> None:
    """The target of a link stays as it is: the link itself is refused, or replaced by force."""
    link = tmp_path / "link.py"
    other = tmp_path / "other.txt"
    other.write_text("precious\n", encoding="utf-8")
    link.symlink_to(other)
    with pytest.raises(HandEditedError):
        write_module(text, link)
    assert write_module(text, link, force=True)
    assert not link.is_symlink()
    assert other.read_text(encoding="utf-8") == "precious\n"


def _failing(error: BaseException) -> Callable[..., Any]:
    def fail(*_: Any, **__: Any) -> Any:
        raise error

    return fail


FULL = OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    "error", [FULL, PermissionError(errno.EPERM, "no"), KeyboardInterrupt()], ids=lambda e: type(e).__name__
)
@pytest.mark.parametrize("step", [(os, "fsync"), (Path, "chmod"), (Path, "replace")], ids=lambda step: step[1])
def test_a_write_that_fails_changes_nothing(
    step: tuple[Any, str], error: BaseException, path: Path, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If writing fails, the old file or none is there, complete, and no other file beside it."""
    new = path.with_name("new.py")
    with monkeypatch.context() as patch:
        patch.setattr(*step, _failing(error))
        with pytest.raises(type(error)):
            write_module(emitted("7*x**2"), path)
        with pytest.raises(type(error)):
            write_module(text, new)
    assert path.read_text(encoding="utf-8") == text
    assert names_in(path.parent) == ["bowl.py"]
    assert write_module(text, new)


def test_text_that_cannot_be_encoded_changes_nothing(path: Path, text: str) -> None:
    """If the text cannot be encoded in the middle of writing, nothing is changed."""
    with pytest.raises(UnicodeEncodeError):
        write_text("a" * 100_000 + "\ud800", path)
    assert path.read_text(encoding="utf-8") == text
    assert names_in(path.parent) == ["bowl.py"]


def test_the_difference(text: str, path: Path) -> None:
    """The difference is empty for the same text, and otherwise a unified diff; a missing file differs in all its
    lines.
    """
    assert difference(text, path) == ""
    shown = difference(emitted("7*x**2"), path)
    assert shown.startswith(f"--- {path} (on disk)\n+++ {path} (generated)\n@@")
    assert {"-z              = 6*x**2", "+z              = 7*x**2"} <= set(shown.splitlines())
    assert difference(text, path.with_name("missing.py")).count("\n+") == len(text.splitlines()) + 1
    assert path.stat().st_mtime == LONG_AGO


@pytest.mark.parametrize("name", ["missing.py", "missing", "folder.py", "missing/missing.py"])
def test_a_module_that_is_not_there(name: str, tmp_path: Path) -> None:
    """A missing file, or a folder, is an error that names it and what to run."""
    (tmp_path / "folder.py").mkdir()
    with pytest.raises(InputError, match=rf"{name}: .*gqm-gen"):
        load(tmp_path / name, "missing")


@pytest.mark.parametrize("version", [INTERFACE - 1, INTERFACE + 1])
def test_a_module_for_another_interface(version: int, text: str, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is refused as it is imported, with what to run."""
    path.write_text(text.replace(f"interface={INTERFACE})", f"interface={version})"), encoding="utf-8")
    monkeypatch.setattr(jit.COMPILER, "callback", _failing(AssertionError("compiled")))
    monkeypatch.setattr(jit.COMPILER, "record", lambda *_: None)
    # Otherwise its functions are those of a module with the same text that another test has loaded.
    monkeypatch.setattr("gqm_sym.runtime.compiled.emitted._IN_USE", WeakValueDictionary())
    with pytest.raises(OutdatedModuleError, match=rf"bowl\.py: .*interface {version} .*{INTERFACE}; run gqm-gen"):
        load(path, "outdated")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(AssertionError, match="compiled"):
        load(path, "current").MODEL.functions.addresses()


def test_build_writes_and_imports(tmp_path: Path) -> None:
    """After `build` the module exists under its name, as a file and as a module."""
    model = gqm.derive(gqm.Curve.graph("6*x**2"), gqm.Gravity(), title="A bowl")
    module = gqm.build(model, name="bowl", folder=tmp_path / "new")
    assert module.__name__ == "bowl"
    assert Path(module.__file__) == (tmp_path / "new" / "bowl.py").resolve()
    assert module.__doc__.startswith("A bowl\n")
    assert (tmp_path / "new" / "bowl.py").read_text(encoding="utf-8") == gqm.emit(model, name="bowl")


def test_build_refuses_an_edited_file(text: str, path: Path) -> None:
    """Nothing is imported or lost; with force the file is written anew."""
    model = gqm.derive(gqm.Curve.graph("6*x**2"), gqm.Gravity())
    path.write_text(text + "raise SystemExit\n", encoding="utf-8")
    with pytest.raises(HandEditedError):
        gqm.build(model, name="bowl", folder=path.parent)
    assert gqm.build(model, name="bowl", folder=path.parent, force=True).PARAMETERS == {"g": "9.81", "m": "1"}


def test_build_stays_in_its_folder(tmp_path: Path) -> None:
    """A name that climbs out of the folder is refused, and nothing is written."""
    model = gqm.derive(gqm.Curve.graph("6*x**2"), gqm.Gravity())
    for name in ("../up", "/elsewhere/up", "up/down", ""):
        with pytest.raises(GQMError, match="name: "):
            gqm.build(model, name=name, folder=tmp_path / "in")
    assert names_in(tmp_path) == []


def test_two_names_for_one_file(path: Path) -> None:
    """A file may be imported twice under two names in one process; both work."""
    one, two = load(path, "one"), load(path, "two")
    assert one is not two
    assert (one.__name__, two.__name__) == ("one", "two")
    assert half_period(one) == half_period(two) > 0.0


def test_one_module_in_two_folders(text: str, path: Path, tmp_path: Path) -> None:
    """The same text, imported from two folders under one name, works in both."""
    twin = tmp_path / "twin" / "bowl.py"
    write_module(text, twin)
    first, second = load(path, "bowl"), load(twin, "bowl")
    halves = [half_period(module) for module in (first, second)]
    assert halves[0] == halves[1] > 0.0
    assert [Path(module.__file__ or "") for module in (first, second)] == [path.resolve(), twin.resolve()]
    path.unlink()  # neither needs the other's file
    assert [half_period(module) for module in (first, second, load(twin, "bowl"))] == [*halves, halves[0]]


def test_a_new_version_in_the_same_place(path: Path) -> None:
    """Nothing that Python cached of the old version is taken for the new one, though name, size and second agree."""
    py_compile.compile(str(path))
    assert half_period(load(path, "bowl")) == pytest.approx(pi / sqrt(2 * 9.81 * 6), rel=1e-9, abs=0)
    size = path.stat().st_size
    write_text(emitted("7*x**2"), path)
    os.utime(path, (LONG_AGO, LONG_AGO))
    assert path.stat().st_size == size
    after = load(path, "bowl")
    assert half_period(after) == pytest.approx(pi / sqrt(2 * 9.81 * 7), rel=1e-9, abs=0)
    assert after.pass1([0.5], lam0=0).z == [1.75]


def test_python_forgets_the_old_version(path: Path) -> None:
    """Bytecode of the old version is removed with it, because Python could not tell it from that of the new one."""
    cached = Path(py_compile.compile(str(path)))
    assert cached.exists()
    write_module(emitted("7*x**2"), path)
    assert not cached.exists()
