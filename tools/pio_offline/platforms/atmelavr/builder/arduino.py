"""The Arduino core and its flags, as in arduino-core-avr's platform.txt."""

from pathlib import Path

from SCons.Script import DefaultEnvironment

env = DefaultEnvironment()
board = env.BoardConfig()
package = Path(env.PioPlatform().get_package_dir("framework-arduino-avr"))
core = str(package / "cores" / board.get("build.core"))

machine = ["-mmcu=$BOARD_MCU"]
env.Append(
    # DECIMAL_DIG: the core's WString.cpp wants it in C++, where avr-gcc 5 does not define it.
    CPPDEFINES=[
        ("F_CPU", "$BOARD_F_CPU"),
        ("ARDUINO", 10808),
        "ARDUINO_ARCH_AVR",
        ("DECIMAL_DIG", "__DECIMAL_DIG__"),
    ],
    CPPPATH=[core, str(package / "variants" / board.get("build.variant"))],
    ASFLAGS=machine,
    ASPPFLAGS=["-x", "assembler-with-cpp"],
    CCFLAGS=[
        *machine,
        "-Os",
        "-ffunction-sections",
        "-fdata-sections",
        "-flto",
        "-fno-fat-lto-objects",
    ],
    CFLAGS=["-std=gnu11"],
    CXXFLAGS=[
        "-std=gnu++11",
        "-fpermissive",
        "-fno-exceptions",
        "-fno-threadsafe-statics",
        "-Wno-error=narrowing",
    ],
    LINKFLAGS=[*machine, "-Os", "-flto", "-fuse-linker-plugin", "-Wl,--gc-sections"],
    LIBS=["m"],
    LIBSOURCE_DIRS=[str(package / "libraries")],
)
env.Prepend(LIBS=[env.BuildLibrary(str(Path("$BUILD_DIR") / "FrameworkArduino"), core)])
