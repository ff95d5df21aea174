import os
import shutil
import signal

import pytest

# Before NumPy is imported; why, see studies/__init__.py.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A shell has what it starts in the background ignore Ctrl-C, which tests send.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def kernel_cache(tmp_path_factory):
    """Compiled kernels of the tests' own, so that what was compiled before makes no difference."""
    base = tmp_path_factory.getbasetemp()
    # The processes of one run compile for each other: their folders lie side by side.
    cache = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "kernels"
    cache.mkdir(exist_ok=True)
    os.environ["SYMMOTION_CACHE"] = str(cache)


@pytest.fixture(scope="session")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    found = filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome")))
    executable = next(found, None)
    if executable is None:
        pytest.skip("no Chromium is installed")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    with playwright.sync_playwright() as run:
        # Playwright starts it on an empty profile of its own.
        chromium = run.chromium.launch(executable_path=executable, args=options)
        yield chromium
        chromium.close()
