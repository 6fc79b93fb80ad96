"""One place for all tests of disturbed commands: the shim is compiled, and the commands are
imported, once."""

import shutil
import sys

import pytest

from disturbance.calls import Place
from disturbance.programs import Program


@pytest.fixture(scope="session")
def place(tmp_path_factory):
    if sys.platform != "linux" or not shutil.which("c++"):
        pytest.skip("the shim needs Linux and a C++ compiler")
    folder = tmp_path_factory.mktemp("disturbed")
    with Program(folder / "program") as program:
        yield Place(program, folder)
