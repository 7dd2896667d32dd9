texel bake "$DATA/cube.obj" -o cube.texel --samples 65
