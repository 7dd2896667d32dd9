# Sourced by start.sh, test.sh and the CI: installs packages with apt-get, says with what to configure, and runs tests.

# install_packages FILE...: the packages listed there that are missing.
install_packages() {
  wanted=$(sed 's/#.*//' "$@")
  missing=
  for package in $wanted; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing="$missing $package"
  done
  [ -n "$missing" ] || return 0
  echo "Installing:$missing"
  as_root=
  [ "$(id -u)" = 0 ] || as_root=sudo
  $as_root apt-get -q update
  # Unquoted on purpose: a list of words.
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends $missing
}

# cache_options: with a compiler cache where there is one.
cache_options() {
  if command -v ccache > /dev/null; then echo "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"; fi
}

# run_tests PRESET: its tests; then why some were skipped, which ctest itself keeps to its log.
run_tests() {
  failed=0
  ctest --preset "$1" || failed=$?
  awk '/: Skipped$/ { getline reason; next } /^\[  SKIPPED \] .* \([0-9]+ ms\)$/ { print "skipped: " $4 ": " reason }' "build/$1/Testing/Temporary/LastTest.log"
  return "$failed"
}
