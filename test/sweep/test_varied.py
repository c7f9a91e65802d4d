"""Tests that `--vary` is read like values of a scene file, and ranges are evenly spaced with both ends."""

import pytest

from rpf3d_core.errors import InputError
from rpf3d_core.sweep.varied import Varied, check_varied, varied_of


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("terrain.benches.berm=6,8.5,1e1", "terrain.benches.berm", (6, 8.5, 10.0)),
        ("a.b=0:1:5", "a.b", (0, 0.25, 0.5, 0.75, 1)),
        ("a.b=1:4:4", "a.b", (1, 2, 3, 4)),
        ("a.b=0.1:0.3:3", "a.b", (0.1, 0.2, 0.3)),
        ("a.b=-5:5:3", "a.b", (-5, 0, 5)),
        ("a = [[1, 2], [3, 4]], [[5, 6], [7, 8]]", "a", (((1, 2), (3, 4)), ((5, 6), (7, 8)))),
        ("rebound=constant,coulomb_limited", "rebound", ("constant", "coulomb_limited")),
        ("rock.diameter={uniform: [0.2, 1]}, 0.5", "rock.diameter", ({"uniform": (0.2, 1)}, 0.5)),
        ("a='x=1',true", "a", ("x=1", True)),
    ],
)
def test_values_are_read_as_in_a_scene_file(text: str, key: str, values: tuple[object, ...]) -> None:
    found = varied_of(text)
    assert found == Varied(key=key, values=values)
    assert list(map(type, found.values)) == list(map(type, values))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("berm", "--vary is 'berm'; write --vary KEY=V1,V2,..."),
        ("=3", "--vary is '=3'"),
        ("berm=", "--vary is 'berm='"),
        ("berm=[1", "its values cannot be read (not valid YAML"),
        ("berm=!!python/object:x 1", "cannot be read"),
        ("berm=5:11", "'5:11' is not a number; write --vary KEY=V1,V2,... or --vary KEY=FIRST:LAST:NUMBER"),
        ("berm=5;11", "'5;11' is not a number; write"),
        ("berm=3:3:4", "two different ends"),
        ("berm=3:4:1", "2 to 1,000 values"),
        ("berm=3:4:1000000", "2 to 1,000 values"),
    ],
)
def test_what_is_not_understood_is_shown(text: str, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        varied_of(text)
    assert sentence in str(caught.value)


def test_a_key_is_varied_once() -> None:
    with pytest.raises(InputError, match="the key a is varied twice"):
        check_varied([Varied("a", (1,)), Varied("a", (2,))])
