#!/bin/sh
# Everything from a bare Debian 12 to a tested build: packages, build, every test.
set -eu
cd "$(dirname "$0")/.."
. tools/setup.sh
install_packages tools/packages.txt tools/packages-test.txt

cmake --preset release -DTEXEL_TESTS=ON -DTEXEL_EXACT=ON $(cache_options)
cmake --build --preset release
run_tests release
