"""JSON as Python's own module reads it, in a fraction of the memory, and slips named where they are."""

import json
import tracemalloc

import numpy as np
import pytest

from symmotion.documents import LONG, read_document
from symmotion.errors import InputError

MATRICES = ",".join(["[[1,0,0],[0,1,0],[0,0,1]]"] * 2000)
SPACED = " ,\n\t".join(["1"] * LONG)
FLAT = ",".join(["1"] * LONG)


def lists(entry):
    """A document with arrays as the lists that they stand for."""
    if isinstance(entry, dict):
        return {name: lists(value) for name, value in entry.items()}
    if isinstance(entry, list):
        return [lists(value) for value in entry]
    return entry.tolist() if isinstance(entry, np.ndarray) else entry


def arrays(entry):
    """How many arrays a document holds."""
    if isinstance(entry, dict | list):
        return sum(map(arrays, entry.values() if isinstance(entry, dict) else entry))
    return isinstance(entry, np.ndarray)


rng = np.random.default_rng(0)
DIGITS = json.dumps(rng.normal(size=(300, 3)).tolist())
WIDE = json.dumps((rng.normal(size=2000) * 10.0 ** rng.integers(-300, 300, 2000)).tolist())


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (f'{{"a": {DIGITS}, "b": {WIDE}, "c": [1, 2]}}', 2),
        (f'{{"a": [[{MATRICES}], "x"], "b": {{"[1,": "\\"[1, 2", "c": [{MATRICES}]}}}}', 1),
        (f'{{"a": [{MATRICES}, [[1,0],[0,1]]]}}', 0),
        (f'{{"a": [{MATRICES}, null], "b": [{FLAT}]}}', 1),
        (f'{{"a": [[{FLAT}], [{FLAT}]], "b": [[{FLAT}], [{FLAT}, 1]]}}', 2),
        (f'{{"a": [[[[{MATRICES}]]]], "b": [[[[[[{MATRICES}]]]]]]}}', 1),
        (f'{{"a": [{FLAT}], "b": NaN, "c": "NaN"}}', 0),
        (f'{{"a": "NaN", "b": [{FLAT}]}}', 0),
        (f'{{"é": [{FLAT}], "\N{GRINNING FACE}": 1e400}}', 1),
        (f'{{"a": [{FLAT}, 1e400, -1E-2, 0.5e+3, -0]}}', 1),
        (f'{{"a": [ {SPACED} ]}}', 1),
        ("{}", 0),
    ],
)
def test_documents_are_what_the_module_json_reads(text, count):
    found = read_document("a.json", text.encode())
    assert repr(lists(found)) == repr(json.loads(text, parse_int=float))
    assert arrays(found) == count
    assert repr(read_document("a.json", text.encode(), arrays=False)) == repr(lists(found))
    outline = read_document("a.json", text.encode(), outline=True)
    assert outline.keys() == found.keys()
    assert not arrays(outline)


def test_arrays_refuse_writes_and_have_the_shape_of_the_lists():
    found = read_document("a.json", f'{{"a": [{MATRICES}]}}'.encode())["a"]
    assert found.shape == (2000, 3, 3)
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 1


@pytest.mark.parametrize(
    "text",
    [
        f'{{"a": [{FLAT}],\n "b": [{MATRICES}],\n "c": x}}',
        f'{{"é": [{FLAT}],\n "b": [{MATRICES}\n, }}',
        f'{{"a": [{FLAT},]}}',
        f'{{"a": [{FLAT},\n ,1]}}',
        f'{{"a": [{FLAT}, 01]}}',
        f'{{"a": [{FLAT}, 1.]}}',
        f'{{"a": [{FLAT}, +1]}}',
        f'{{"a": [{FLAT} 1]}}',
        f'{{"a": [{MATRICES}',
        f'{{"a":\r\n [{MATRICES}, [[1,0,0],[0',
        f'{{"a": [{MATRICES}]]}}',
        f'{{"a": "b\n", "c": [{MATRICES}]}}',
        '{"a": "b',
    ],
)
def test_slips_are_named_where_the_module_json_finds_them(text):
    with pytest.raises(json.JSONDecodeError) as wanted:
        json.loads(text)
    with pytest.raises(InputError) as found:
        read_document("a.json", text.encode())
    fault = wanted.value
    assert str(found.value) == f"a.json, line {fault.lineno}, column {fault.colno}: {fault.msg}"


def test_a_mark_of_utf_8_is_no_part_of_the_text():
    with pytest.raises(InputError, match=r"a\.json, line 1, column 7: "):
        read_document("a.json", b'\xef\xbb\xbf{"a": x}')
    assert read_document("a.json", b'\xef\xbb\xbf{"a": 1}') == {"a": 1.0}


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a": ' + "[" * 100_000])
def test_deep_lists_are_refused(text):
    with pytest.raises(InputError, match=r"a\.json: its lists are nested too deeply"):
        read_document("a.json", text.encode())


@pytest.mark.parametrize(
    "text", [f'{{"a": [{MATRICES}]}}', f'{{"a": [{FLAT}], "b": [{MATRICES}', f'{{"a": [{MATRICES}, x]}}']
)
def test_memory_stays_below_eight_times_the_text(text):
    data = text.encode()
    tracemalloc.start()
    try:
        read_document("a.json", data)
    except InputError:
        pass
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < 7 * len(data)  # beside the text itself
