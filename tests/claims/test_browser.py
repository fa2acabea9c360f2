"""A real browser lays out the formulas of a report and draws its figures; it fetches nothing and reports no errors."""

import json
import os
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paths import ROOT

from gqm_sym.cli import tool

CURVES = ROOT / "curves"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER = next((found for name in NAMES if (found := shutil.which(name))), "")
# The browser itself must not use the network.
QUIET = (
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--host-rules=MAP * ~NOTFOUND",
)

pytestmark = pytest.mark.skipif(not BROWSER, reason=f"no browser: none of {', '.join(NAMES)} is installed")

# This script is added to a copy of the page, and writes the page's layout into its title.
MEASURE = """<script>
addEventListener("load", () => {
const box = (element) => { const b = element.getBoundingClientRect(); return [b.width, b.height]; };
const all = (name) => [...document.getElementsByTagName(name)].map(box);
document.title = JSON.stringify({
  math: all("math"), svg: all("svg"), mfrac: all("mfrac"), mi: all("mi"), table: all("table"),
  fetched: performance.getEntriesByType("resource").map((entry) => entry.name),
  page: document.documentElement.scrollWidth, window: window.innerWidth,
});
});
</script></body>"""


def browse(page: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run the browser on a page, with a profile of its own."""
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
    profile = f"--user-data-dir={page.parent / 'profile'}"
    command = [
        BROWSER,
        "--headless=new",
        "--disable-gpu",
        "--window-size=1100,2500",
        profile,
        *sandbox,
        *QUIET,
        *options,
    ]
    return subprocess.run([*command, page.as_uri()], capture_output=True, text=True, timeout=120, check=True)


@pytest.fixture(scope="module", params=["pendulum", "circle_coulomb"])
def page(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the report of an example, all of it in one file."""
    path = tmp_path_factory.mktemp("report") / f"{request.param}.html"
    assert tool.main(["report", str(CURVES / f"{request.param}.yaml"), "-o", str(path)]) == 0
    return path


def measured(page: Path, text: str) -> tuple[dict[str, Any], str]:
    """Return how a browser displays a page's text, and its messages meanwhile."""
    copy = page.with_name("copy.html")
    copy.write_text(text.replace("</body>", MEASURE), encoding="utf-8")
    ran = browse(copy, "--dump-dom", "--enable-logging=stderr")
    found = re.search(r"<title>(\{.*?\})</title>", ran.stdout)
    assert found
    return json.loads(unescape(found[1])), ran.stderr


def test_the_page_is_laid_out(page: Path) -> None:
    """Fractions are taller than letters, figures have their size, nothing exceeds the page or is fetched, and there are
    no error messages.
    """
    text = page.read_text(encoding="utf-8")
    seen, said = measured(page, text)
    assert seen["fetched"] == []
    assert "CONSOLE" not in said
    assert len(seen["math"]) == text.count("<math")
    assert min(width for width, _ in seen["math"]) > 20
    assert min(height for _, height in seen["mfrac"]) > 1.5 * min(height for _, height in seen["mi"])
    assert len(seen["svg"]) >= 2
    assert min(min(box) for box in seen["svg"]) > 200
    assert seen["page"] <= seen["window"]


def test_what_is_wrong_would_be_seen(tmp_path: Path) -> None:
    """The check detects a page that fetches something and fails."""
    text = "<html><body><img src='http://127.0.0.1:9/x.png'/><script>nothing()</script></body></html>"
    seen, said = measured(tmp_path / "bad.html", text)
    assert seen["fetched"] == ["http://127.0.0.1:9/x.png"]
    assert re.search("CONSOLE.*nothing is not defined", said)


def test_the_picture_has_the_figures(page: Path) -> None:
    """Both colours of the curves occur in the picture."""
    import matplotlib.image

    picture = page.with_name("page.png")
    browse(page, f"--screenshot={picture}")
    pixels = (matplotlib.image.imread(picture)[..., :3] * 255).round().astype(int)
    for colour in ((0, 0x72, 0xB2), (0xD5, 0x5E, 0)):
        assert (np.abs(pixels - np.array(colour)).max(axis=-1) <= 2).sum() > 200
