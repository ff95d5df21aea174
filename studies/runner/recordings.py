"""Where recorded data lie: beside the checkout, not in it. Where they are absent, studies run on example data."""

from pathlib import Path

RECORDINGS = Path(__file__).resolve().parents[3] / "shared" / "data"


def recorded(name: str) -> Path:
    """The path of a recorded file, which may be absent: whoever reads it asks `is_file()` first."""
    return RECORDINGS / name
