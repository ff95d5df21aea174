import os

import pytest

# Before NumPy is imported; why, see studies/__init__.py.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session", autouse=True)
def kernel_cache(tmp_path_factory):
    """Compiled kernels of the tests' own, so that what was compiled before makes no difference."""
    os.environ["SYMMOTION_CACHE"] = str(tmp_path_factory.mktemp("kernels"))
