"""The top level: what is imported when it is asked for, and that type checkers are told the same."""

import ast
import subprocess
import sys
from pathlib import Path

import symmotion


def test_type_checkers_see_what_is_imported_late():
    tree = ast.parse(Path(str(symmotion.__file__)).read_text(encoding="utf-8"))
    (typed,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {
        (str(n.module).removeprefix("symmotion"), a.name)
        for n in typed.body
        for a in getattr(n, "names", ())
        if isinstance(n, ast.ImportFrom)
    }
    late = {(f".{place}", name) for place, names in symmotion.PLACES.items() for name in names.split()}
    for group in symmotion.GROUPS:
        room, _, name = group.rpartition(".")
        late.add((f".{room}" if room else "", name))
    assert late == seen
    assert {name for _, name in late} == set(symmotion.__all__)


def test_importing_symmotion_imports_nothing_of_size():
    code = """
        import sys
        import symmotion as sm
        print(*(name for name in ("numpy", "scipy", "casadi", "symmotion.program") if name in sys.modules))
        print(sm.interpolants.component_cubic.__name__, sm.Rigidity() == sm.energies.Rigidity(), sm.fair.__name__)
        print("matplotlib" in sys.modules)
    """
    code = "\n".join(line.strip() for line in code.splitlines())
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["", "component_cubic True fair", "False"]
