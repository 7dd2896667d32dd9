# The cube is red 0.8: a light of 2 is too much for a PNG, not for an EXR.
texel bake "$DATA/cube.obj" -o png.texel --recipe "$DATA/small.json" --want slices --light ambient:2,1,1 &&
texel bake "$DATA/cube.obj" -o exr.texel --recipe "$DATA/small.json" --want slices --light ambient:2,1,1 --slice-format exr &&
texel info png.texel | grep issue
