"""Before a build: what is made of protocol.toml is made anew, or the build stops."""

import subprocess
import sys

Import("env")  # noqa: F821
if subprocess.run([sys.executable, env.subst("$PROJECT_DIR/protocol.py")]).returncode:  # noqa: F821
    env.Exit(1)  # noqa: F821
