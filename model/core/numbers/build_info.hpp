// How this build of the core was compiled.
#pragma once

namespace flexura {

// The processor's instructions that it uses: "plain" (all processors of the architecture have them)
// or a level, "x86-64-v3".
const char *build_level();

// Name and version of the compiler.
const char *build_compiler();

// Whether packs are plain arrays (FLEXURA_PORTABLE).
bool build_portable();

}  // namespace flexura
