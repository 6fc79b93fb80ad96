"""With -flto the linker compiles: it must be told the same optimization as the compiler."""

Import("env")  # noqa: F821
env.Append(LINKFLAGS=["-O2", "-funroll-loops", "-finline-functions"])  # noqa: F821
