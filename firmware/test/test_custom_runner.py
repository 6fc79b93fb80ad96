"""PlatformIO's runner of the unit tests: reads the lines that check.h prints, which are Unity's,
and downloads nothing."""

from platformio.public import UnityTestRunner


class CustomTestRunner(UnityTestRunner):
    EXTRA_LIB_DEPS = None

    def configure_build_env(self, env):
        env.Append(CPPPATH=["$PROJECT_TEST_DIR"])
        return env
