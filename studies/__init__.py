"""One file per question: each module's STUDY asks it and answers with tables, figures and runs."""

import os

# Before NumPy is imported. The matrices here are small: threads of BLAS only wait for each other, and where
# another process has a core they take a hundred times as long as one thread does.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The folders of studies as the report lists them.
SUBJECTS = ("affine", "quaternions", "curves", "fairing", "recorded", "sweeps", "solving", "guide")
