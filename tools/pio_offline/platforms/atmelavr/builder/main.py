"""Links firmware.elf, holds its size against the board's memory, makes firmware.hex, uploads it
with avrdude."""

from SCons.Script import AlwaysBuild, Default, DefaultEnvironment

env = DefaultEnvironment()
env.Replace(
    CC="avr-gcc",
    CXX="avr-g++",
    AR="avr-gcc-ar",
    RANLIB="avr-gcc-ranlib",
    OBJCOPY="avr-objcopy",
    SIZETOOL="avr-size",
    ARFLAGS=["rcs"],
    PROGNAME="firmware",
    PROGSUFFIX=".elf",
    SIZECHECKCMD="$SIZETOOL -A -d $SOURCES",
    SIZEPROGREGEXP=r"^(?:\.text|\.data|\.bootloader)\s+([0-9]+).*",
    SIZEDATAREGEXP=r"^(?:\.data|\.bss|\.noinit)\s+([0-9]+).*",
)

program = env.BuildProgram()
image = env.Command(
    "$BUILD_DIR/${PROGNAME}.hex",
    program,
    env.VerboseAction("$OBJCOPY -O ihex -R .eeprom $SOURCE $TARGET", "Building $TARGET"),
)
env.Depends(image, "checkprogsize")
AlwaysBuild(env.Alias("buildprog", image))

upload = env.BoardConfig().get("upload")
load = (
    f"avrdude -p $BOARD_MCU -c {upload['protocol']} -b {upload['speed']} -P $UPLOAD_PORT -D -U "
    f"flash:w:$SOURCE:i"
)
actions = [
    env.VerboseAction(env.AutodetectUploadPort, "Looking for the board"),
    env.VerboseAction(load, "Uploading $SOURCE"),
]
AlwaysBuild(env.Alias("upload", image, actions))
Default("buildprog")
