"""The build of the guide, of one small page: what it shows, and that a warning is an error."""

import re

import pytest

from studies.guide.__main__ import main
from studies.guide.building import gallery, pages, reference

PAGE = """# Symmotion

$x^2$, and `sm.InputError`.

$$x = \\sum_{i = 1}^{n} a_i + b_i + c_i + d_i + e_i + f_i + g_i, \\qquad y = a + b + c + d + e + f + g + h$$

```{formula} symmotion/version.py
:code: __version__ =
:of: symmotion.InputError
v = 0.2
```

```python : A straight way.
import symmotion as sm
print(6 * 7)
keys = sm.Keyframes([0.0, 1.0], [[[1.0, 0.0], [0.0, 1.0]]] * 2, [[0.0, 0.0], [2.0, 1.0]])
sm.interpolants.component_cubic(keys).plot(keyframes=keys)
```

```python
sm.report.player("moving", {"spline": sm.interpolants.component_cubic(keys)}, None, "A letter.", keys)
```
"""
ENTRY = "Top\n===\n\n.. autoclass:: symmotion.InputError\n"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Builds a site of one page, and returns the exit status and the page."""
    pytest.importorskip("sphinx")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pages, "sources", lambda: ["index"])
        patch.setattr(reference, "pages", lambda: {"top": ENTRY})
        patch.setattr(gallery, "pages", lambda progress: {})

        def build(text: str):
            patch.setattr(pages, "source", lambda name: text)
            folder = tmp_path_factory.mktemp("site")
            return main(["-o", str(folder), "--quiet"]), folder / "index.html"

        yield build


@pytest.fixture(scope="module")
def site(written):
    status, index = written(PAGE + "\n```{toctree}\n:hidden:\n\ntop\n```\n")
    assert status == 0
    return index


def test_a_page_shows_what_its_code_does_and_fetches_nothing(site):
    page = site.read_text(encoding="utf-8")
    assert "<math" in page and re.search(r'class="output.*?>42', page, re.DOTALL)
    assert page.count('<figure class="player"') == 1 and "<figcaption>A straight way.</figcaption>" in page
    assert "0.2.0" in page and 'href="top.html#symmotion.InputError"' in page
    fetched = re.findall(r'<(?:link|script|img|iframe)[^>]*(?:src|href)="(https?:[^"]*)"', page)
    assert fetched == []


def test_the_site_is_read_and_searched_without_a_network(site, browser):
    context = browser.new_context(offline=True)
    page, asked, trouble = context.new_page(), [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: trouble.append(str(error)))
    for url in (site.as_uri(), f"{site.with_name('search.html').as_uri()}?q=straight"):
        page.goto(url)
    page.wait_for_selector("#search-results li a")
    assert page.locator("#search-results li a").first.inner_text() == "Symmotion"
    assert trouble == [] and [url for url in asked if not url.startswith(("file:", "data:"))] == []
    context.close()


def test_on_a_phone_nothing_sticks_out_and_formulas_stand_below_each_other(site, browser):
    context = browser.new_context(viewport={"width": 390, "height": 800}, is_mobile=True)
    page = context.new_page()
    page.goto(site.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    upper, lower = (found.bounding_box() for found in page.locator("div.math").first.locator("math").all())
    assert upper and lower and upper["y"] + upper["height"] <= lower["y"] and lower["x"] + lower["width"] <= 390
    context.close()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("# A\n\n[there](nowhere.md)\n", "nowhere"),
        ("# A\n\n`sm.nothing`\n", "`sm.nothing` is not in the reference"),
        ("# A\n\n```python\n1 / 0\n```\n", "ZeroDivisionError"),
        ("# A\n\n$\\nothing$\n", "nothing"),
    ],
)
def test_what_is_wrong_on_a_page_fails_the_build(written, capsys, text, told):
    assert written(text)[0] == 1
    assert told in capsys.readouterr().err
