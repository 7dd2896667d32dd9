texel bake "$DATA/cube.obj" -o cube.texel --res 16
