import sys

import pytest
from studied import is_answer

from symmotion.report import StudyResult


@pytest.fixture(scope="session", autouse=True)
def answered():
    """Whatever study a test runs, its result has an answer."""
    patch, plain = pytest.MonkeyPatch(), StudyResult.__post_init__

    def checked(self: StudyResult) -> None:
        plain(self)
        # The caller of the class, behind the __init__ that dataclasses write.
        if sys._getframe(2).f_globals["__name__"].startswith("studies."):
            assert is_answer(self.answer), f"no answer of one sentence: {self.answer!r}"

    patch.setattr(StudyResult, "__post_init__", checked)
    yield
    patch.undo()
