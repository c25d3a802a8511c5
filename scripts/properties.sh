#!/usr/bin/env bash
# Prints the test files with laws that hold for all machines (hypothesis), and those of the public names.
grep -rlE "^(from|import) hypothesis" test --include="test_*.py" --exclude-dir=integration
printf '%s\n' test/test_public_names.py test/test_command_line.py
