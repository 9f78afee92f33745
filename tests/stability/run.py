"""Runs a command of the harness as a test; exits with 77, meson's "skipped", without a device."""
import sys

from harness.__main__ import EXIT_DEVICE, main

code = main(sys.argv[1:])
sys.exit(77 if code == EXIT_DEVICE else code)
