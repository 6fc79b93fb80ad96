"""Links a program with this machine's own compiler."""

from SCons.Script import AlwaysBuild, Default, DefaultEnvironment

env = DefaultEnvironment()
AlwaysBuild(env.Alias("buildprog", env.BuildProgram()))
Default("buildprog")
