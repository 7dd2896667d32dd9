# What is not wanted is not there, and its libraries are not loaded.
LD_DEBUG=libs LD_DEBUG_OUTPUT=libs texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" --want slices --slices z || exit
find cube.texel -type f | LC_ALL=C sort
grep -lE 'libOpenImageIO|libopenvdb' libs.*
exit 0
