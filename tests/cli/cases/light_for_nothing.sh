# Light without slices, shadows without light: done without, said with -v and in the manifest.
texel bake "$DATA/cube.obj" -o a.texel --recipe "$DATA/small.json" --want density --light ambient:1,1,1 -v 2>&1 | grep light
texel bake "$DATA/cube.obj" -o b.texel --recipe "$DATA/small.json" --want density --shadows -v 2>&1 | grep shadows
texel info a.texel | grep light
