"""Files appear whole or not at all, and a kill leaves nothing that the next write does not remove."""

import os
import signal
import subprocess
import sys
import time

import pytest

import symmotion as sm
from symmotion import whole

WRITING = """
import sys, time
from symmotion.whole import whole_file, whole_files
if sys.argv[2] == "one":
    with whole_file(sys.argv[1]) as handle:
        handle.write("half")
        handle.flush()
        print("writing", flush=True)
        time.sleep(60)
with whole_files(sys.argv[1]) as part:
    part.write_text("half")
    print("writing", flush=True)
    time.sleep(60)
"""


@pytest.fixture(params=["one", "several"])
def writer(request, tmp_path):
    """A process in the middle of writing, to be killed."""
    target = tmp_path / "motion.json"
    target.write_text("before")
    process = subprocess.Popen([sys.executable, "-c", WRITING, target, request.param], stdout=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline() == b"writing\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


@pytest.mark.skipif(sys.platform == "win32", reason="no locks")
def test_what_a_kill_leaves_is_removed_by_the_next_write(writer, tmp_path):
    target = tmp_path / "motion.json"
    # Not while the process lives.
    sm.write_keyframes(sm.examples.planar_keyframes(), tmp_path / "other.json")
    assert len(list(tmp_path.glob(whole.PREFIX + "*"))) == 1 and target.read_text() == "before"
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    assert target.read_text() == "before" and len(list(tmp_path.iterdir())) == 3
    sm.write_keyframes(sm.examples.planar_keyframes(), tmp_path / "another.json")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["another.json", "motion.json", "other.json"]


def test_without_locks_what_is_a_day_old_is_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(whole, "_hold", lambda directory: None)
    young, old = tmp_path / f"{whole.PREFIX}young", tmp_path / f"{whole.PREFIX}old"
    for left in (young, old):
        left.mkdir()
        (left / "part").write_text("half")
    then = time.time() - 2 * whole.FORGOTTEN
    os.utime(old, (then, then))
    with whole.whole_file(tmp_path / "a.txt") as handle:
        handle.write("whole")
    assert sorted(p.name for p in tmp_path.iterdir()) == [young.name, "a.txt"]


def test_links_and_files_of_such_names_stay(tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "kept").write_text("kept")
    place = tmp_path / "place"
    place.mkdir()
    (place / f"{whole.PREFIX}link").symlink_to(elsewhere)
    (place / f"{whole.PREFIX}file").write_text("kept")
    with whole.whole_file(place / "a.txt") as handle:
        handle.write("whole")
    assert (elsewhere / "kept").exists() and len(list(place.iterdir())) == 3


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("before")
    with pytest.raises(ZeroDivisionError), whole.whole_file(target) as handle:
        handle.write("half")
        raise ZeroDivisionError
    assert target.read_text() == "before" and list(tmp_path.iterdir()) == [target]
