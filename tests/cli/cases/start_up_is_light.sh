# The libraries that are slow to load must not be there before they are needed.
for arguments in "--version" "--help" "bake --help" "bake --frobnicate"; do
  LD_DEBUG=libs texel $arguments 2>&1 | grep -E 'libOpenImageIO|libopenvdb' && echo "loaded by texel $arguments"
done
exit 0
