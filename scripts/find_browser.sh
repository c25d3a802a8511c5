#!/usr/bin/env bash
# Prints the path of a browser that the panel's tests can use; fails where there is none.
command -v chromium || command -v chromium-browser || command -v google-chrome
