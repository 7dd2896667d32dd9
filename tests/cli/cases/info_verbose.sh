# How an error figure was found is told with -v.
texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" && texel info cube.texel | grep relative && texel info -v cube.texel | grep relative
