"""What a new user does: the commands and examples of the README and of the guide's first page, one after the other.

`python .ci/new_user.py DIR` in a fresh environment, from a copy of the checkout that holds nothing else. Commands run
in a shell as they are printed, examples of Python as programs of their own, files are saved under the names they have.
The README's later commands, of the guide and the tests, run elsewhere in CI; that they are those is looked at.
"""

import re
import subprocess
import sys
from pathlib import Path

FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ELSEWHERE = {
    'python -m pip install ".[docs]" && python -m studies.guide -o site',
    'python -m pip install ".[test]" && python -m pytest',
}


def main(directory: str) -> None:
    checkout = Path(directory).resolve()
    done: set[str] = set()
    elsewhere: set[str] = set()
    for page in ("README.md", "studies/guide/pages/start.md"):
        # Of the README the programs stand alone; of a page of the guide they go on from block to block.
        program = ""
        for language, said, code in FENCE.findall((checkout / page).read_text(encoding="utf-8")):
            name = re.match(r" file (\S+)", said)
            if name:
                (checkout / name[1]).write_text(code, encoding="utf-8")
            elif language == "python":
                program = code if page == "README.md" else program + code
                follow(page, [sys.executable, "-c", program], checkout)
            elif language == "sh":
                for line in code.strip().splitlines():
                    if line in ELSEWHERE:
                        elsewhere.add(line)
                    elif line not in done and not any(line in other for other in done):
                        done.add(line)
                        follow(page, ["bash", "-ec", line], checkout)
    assert elsewhere == ELSEWHERE, f"the README has other commands: {elsewhere}"
    assert (checkout / "report" / "index.html").is_file() and (checkout / "camera.gif").stat().st_size > 10_000
    print(f"a new user: {len(done)} commands and all examples")


def follow(page: str, command: list[str], checkout: Path) -> None:
    print(f"== {page}: {command[-1].splitlines()[-1]}", flush=True)
    ended = subprocess.run(command, cwd=checkout, env=None)
    if ended.returncode:
        sys.exit(f"{page}: ended with {ended.returncode}:\n{command[-1]}")


if __name__ == "__main__":
    main(sys.argv[1])
