texel bake "$DATA/cube.obj" -o cube.texel -r
