"""What the compiler is told beside platformio.ini.

With -flto the linker compiles: it must be told the same optimization as the compiler. The program
is told the hash of its own sources.
"""

import sys

Import("env", "projenv")  # noqa: F821
sys.path.insert(0, env.subst("$PROJECT_DIR"))  # noqa: F821
from source_hash import source_hash  # noqa: E402

env.Append(LINKFLAGS=["-O2", "-funroll-loops", "-finline-functions"])  # noqa: F821
projenv.Append(CPPDEFINES=[("FLEXURA_FIRMWARE_HASH", f"0x{source_hash():08X}UL")])  # noqa: F821
