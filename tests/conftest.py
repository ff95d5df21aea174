import os

import pytest

# Before NumPy is imported; why, see studies/__init__.py.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session", autouse=True)
def kernel_cache(tmp_path_factory):
    """Compiled kernels of the tests' own, so that what was compiled before makes no difference."""
    base = tmp_path_factory.getbasetemp()
    # The processes of one run compile for each other: their folders lie side by side.
    cache = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "kernels"
    cache.mkdir(exist_ok=True)
    os.environ["SYMMOTION_CACHE"] = str(cache)
