# The cases that are too slow for `scripts/test.sh --fast`, by test program, as filters of GoogleTest.
# Written by scripts/slow_tests.py from what they took; all others are fast.
