"""Files that are no robot file: which file it is, and why, stands in one line."""

import pytest

import flexura as fx
from robot_files import COMPLETE, refused

DEEP = 100_000
FILES = {
    "an empty file": (b"", "link: missing"),
    "blanks": (b"  \n\n# nothing\n", "link: missing"),
    "binary rubbish": (bytes(range(256)) * 10, "not a text (byte 128 is not UTF-8)"),
    "a program": (b"\x7fELF\x02\x01\x01\x00\x00", "not valid TOML"),
    "UTF-16": (COMPLETE.encode("utf-16"), "not a text (byte 0 is not UTF-8)"),
    "Latin-1": ('name = "Röhre"'.encode("latin-1"), "not a text (byte 9 is not UTF-8)"),
    "JSON": (b'{"name": "rig"}', "not valid TOML"),
    "a broken value": (b"name = ", "not valid TOML"),
    "a broken table": (b"[[link]\nlength_m = 1\n", "not valid TOML"),
    "an unclosed text": (b'name = "rig\n', "not valid TOML"),
    "a key given twice": (b'name = "a"\nname = "b"\n', "not valid TOML"),
    "a list that is a number": (b"link = 3\n[[link]]\n", "not valid TOML"),
    "an impossible date": (b"name = 1979-13-01\n", "not valid TOML"),
    "11 MB": (b"#" * 11_000_000, "more than 10 MB"),
    "deep lists": (b"x = " + b"[" * DEEP + b"]" * DEEP, "nested too deeply"),
    "deep tables": (b"x = " + b"{a = " * DEEP + b"1" + b"}" * DEEP, "nested too deeply"),
    "deep keys": (b"x" + b".a" * DEEP + b" = 1", "nested too deeply"),
    "deep headers": (b"[x" + b" . a" * DEEP + b"]", "nested too deeply"),
    "a number of 5000 digits": (b"x = 1" + b"0" * 5000, "not valid TOML"),
    "a hexadecimal number of 5000 digits": (
        COMPLETE.replace("0.30", "0x" + "f" * 5000).encode(),
        "link[2].length_m = (a very long int)",
    ),
    "a key with a line end": (
        ('"a\\nb\\u2028" = 1\n' + COMPLETE).encode(),
        "a\\nb\\u2028 = 1: an unknown key",
    ),
    "a key of a million letters": (
        ("a" * 10**6 + " = 1\n" + COMPLETE).encode(),
        "aaa... = 1: an unknown key",
    ),
    "a date as a value": (
        COMPLETE.replace("0.30", "1979-05-27").encode(),
        "link[2].length_m = datetime.date(1979, 5, 27)",
    ),
    "several wrong values": (
        COMPLETE.replace("0.30", "-1").replace("7850.0", "1").encode(),
        "(and 1 more wrong value)",
    ),
}


@pytest.mark.parametrize("content, words", FILES.values(), ids=FILES)
def test_a_file_that_is_no_robot_file_is_named(tmp_path, content, words):
    path = tmp_path / "wrong.toml"
    path.write_bytes(content)
    assert words in str(refused(path))


def test_what_is_not_a_file_is_named(tmp_path):
    assert "a directory: expected the path of a TOML file" in str(refused(tmp_path))
    assert "no such file: expected the path of a TOML file" in str(
        refused(tmp_path / "absent.toml")
    )
    (tmp_path / "a.toml").write_text("")
    assert "cannot be read" in str(refused(tmp_path / "a.toml" / "b.toml"))
    with pytest.raises(fx.InputError, match="cannot be read"):
        fx.load("a\0b")


def test_a_line_end_in_the_files_name_does_not_break_the_line(tmp_path):
    with pytest.raises(fx.InputError) as caught:
        fx.load(tmp_path / "a\nb.toml")
    assert str(caught.value).isprintable() and "a\\nb.toml: no such file" in str(caught.value)


def test_the_error_carries_what_it_says(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(COMPLETE.replace("7850.0", "7.85"))
    error = refused(path)
    assert (error.file, error.key, error.value) == (str(path), "link[2].density_kg_m3", 7.85)
    assert isinstance(error, fx.FlexuraError)
