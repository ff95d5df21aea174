import os

# Before NumPy is imported; why, see studies/__init__.py.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
